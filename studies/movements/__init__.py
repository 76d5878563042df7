"""Models of movements compared on recorded people and on the synthetic demonstrator, all by one protocol."""
