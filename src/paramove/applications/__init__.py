"""Applications: the logic of rule learning, relocation by pointing and reaching, over messages, for any robot."""
