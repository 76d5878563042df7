"""A running application from outside."""
