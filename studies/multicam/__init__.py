"""Arms reconstructed from several real cameras."""
