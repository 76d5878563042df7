"""A parametric HMM whose means are neural networks of theta (thesis 3.3.2), their training and choice."""
