from .arm_body import BENT_POSE_POINTS as BENT_POSE_POINTS
from .arm_body import POSE_POINTS as POSE_POINTS
from .arm_body import ArmSizes as ArmSizes
from .arm_body import fitted_poses as fitted_poses
from .arm_observer import ArmObserver as ArmObserver
from .arm_observer import ContourMatch as ContourMatch
from .options import ObservationOptions as ObservationOptions
from .presence import Presence as Presence
