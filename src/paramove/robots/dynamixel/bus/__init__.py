"""Servos on a serial bus: models and registers, the protocol, what finds, sets up and measures them."""
