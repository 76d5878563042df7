"""How near the robot's movement comes to the person's: the experiment of thesis 5.2.7 (figures 5.15 to 5.18)."""
