"""Pointing with the arm: targets of tracking in action space, and the window of thesis and paper over an arm's pose."""
