from .arming_at_start import REAL_ROBOT as REAL_ROBOT
from .arming_at_start import Operator as Operator
from .arming_key import ArmingKey as ArmingKey
from .jogging import Jogging as Jogging
from .terminal_arming import TERMINAL as TERMINAL
from .terminal_arming import obeyed as obeyed
from .terminal_arming import request_arming as request_arming
from .terminal_stop import stop_arm as stop_arm
