"""Coloured objects and a hand on a table: tracking, the plane's homography, and the gestures that they make."""
