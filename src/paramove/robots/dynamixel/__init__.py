"""Dynamixel servos on a serial bus: packets of Protocol 2.0, control tables, and servos emulated at the wire."""
