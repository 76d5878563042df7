from .driver import ArmDriver as ArmDriver
from .driver import DriverSays as DriverSays
from .stream import StreamReader as StreamReader
from .stream import StreamWriter as StreamWriter
