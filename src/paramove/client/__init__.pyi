from .content import message_of as message_of
from .playing import is_played as is_played
from .playing import play as play
from .run import NoMessageError as NoMessageError
from .run import NotConnectedError as NotConnectedError
from .run import Run as Run
from .run import connect as connect
