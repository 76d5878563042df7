"""Other people's libraries as methods of the comparison, imported where they are used: the extra `peers` has them."""
