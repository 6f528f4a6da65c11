"""What things are: value types and geometry, on NumPy alone."""
