"""The run as a part of ROS 2: joint states, images, markers and diagnostics go there; goals and stops come from there.

Needs the extra `ros2`: rclpy and ROS's messages, as wheels.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
