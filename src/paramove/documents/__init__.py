"""Files that somebody else made, read within limits: YAML with positions, arrays, images; each fault is one message."""
