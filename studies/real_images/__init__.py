"""Tracking in action space on images of a real camera: a seated person who points."""
