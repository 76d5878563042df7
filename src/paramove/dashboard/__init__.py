"""The live page: what a running application sees, believes and does, in a browser, and a stop button."""
