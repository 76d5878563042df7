"""paramove: parametric human movements, learned from few demonstrations."""
