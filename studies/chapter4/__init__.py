"""The experiments of thesis chapter 4."""
