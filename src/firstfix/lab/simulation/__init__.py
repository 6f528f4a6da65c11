"""A simulated robot and its sensors."""
