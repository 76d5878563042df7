"""Teaching in front of cameras, with simulated movements and key points at the measured noise."""
