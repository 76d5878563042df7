from .firmware import Firmware as Firmware
from .wire import batch_message as batch_message
from .wire import receive as receive
from .wire import state_message as state_message
from .wire import state_of as state_of
