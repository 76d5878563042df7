"""Faults of the running demo, provoked and measured: processes killed and stopped, and the table of all faults."""
