"""What is wrong with a machine, its installation and what is plugged in, with the command that mends it."""
