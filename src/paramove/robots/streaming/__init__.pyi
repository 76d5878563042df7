from .driver import ArmDriver as ArmDriver
from .driver import DriverOutput as DriverOutput
from .stream import Frames as Frames
from .stream import Playing as Playing
from .stream import StreamBatch as StreamBatch
from .stream import StreamReader as StreamReader
from .stream import StreamState as StreamState
