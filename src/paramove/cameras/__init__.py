"""Where images come from and how they are measured: sources, calibration boards, lenses, places, stereo."""
