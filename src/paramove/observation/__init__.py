"""The observation model of thesis 6.6: how well images agree with a posture of the arm."""

from paramove.observation.arm_body import BENT_POSE_POINTS, POSE_POINTS, ArmSizes, fitted_poses
from paramove.observation.arm_observer import ArmObserver, ContourMatch
from paramove.observation.cameras import CalibratedCamera, read_cameras, write_cameras
from paramove.observation.options import ObservationOptions
from paramove.observation.presence import Presence

__all__ = [
    "BENT_POSE_POINTS",
    "POSE_POINTS",
    "ArmObserver",
    "ArmSizes",
    "CalibratedCamera",
    "ContourMatch",
    "ObservationOptions",
    "Presence",
    "fitted_poses",
    "read_cameras",
    "write_cameras",
]
