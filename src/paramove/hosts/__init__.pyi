from . import link as link
from .keys import HostKeyError as HostKeyError
from .keys import HostKeys as HostKeys
from .keys import KeyPair as KeyPair
from .keys import PublicKey as PublicKey
from .relay import Relay as Relay
from .settings import Peer as Peer
from .settings import RelaySettings as RelaySettings
