from .bridge import MissingRos2Error as MissingRos2Error
from .bridge import Ros2Bridge as Ros2Bridge
