"""An arm of servos, driven and watched; and one whose torque is off, to be taught by hand."""
