"""A learned movement on a robot's body (thesis 5.2): conversion, inverse kinematics, goals, clearance, timing."""
