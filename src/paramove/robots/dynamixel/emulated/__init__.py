"""Emulated servos behind a pseudo-terminal: they speak the real bytes, move and fail as real ones do."""
