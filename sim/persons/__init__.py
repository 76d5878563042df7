"""Persons of the simulator: their bodies, their performances, and clips of them."""
