from .arming_at_start import REAL_ROBOT as REAL_ROBOT
from .arming_at_start import Operator as Operator
from .arming_key import ArmingKey as ArmingKey
from .jogging import Jogging as Jogging
from .terminal import TERMINAL as TERMINAL
from .terminal import obeyed as obeyed
from .terminal import request_arming as request_arming
from .terminal import stop_arms as stop_arms
