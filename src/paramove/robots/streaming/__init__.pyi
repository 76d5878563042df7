from .driver import ArmDriver as ArmDriver
from .driver import DriverOutput as DriverOutput
from .stream import StreamReader as StreamReader
from .stream import StreamWriter as StreamWriter
