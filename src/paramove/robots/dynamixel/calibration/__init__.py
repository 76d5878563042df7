"""From servos to joints of a robot: the calibration, and how a person makes one."""
