from .content import message_of as message_of
from .run import NoMessageError as NoMessageError
from .run import Run as Run
from .run import connect as connect
