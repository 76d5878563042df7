"""The experiments of thesis chapter 6: tracking in action space on rendered performances."""
