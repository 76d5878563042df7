"""What a run was worth: numbers, report and video of a run, and the same over many runs. May read the ground truth."""
