"""Value types and geometry, on NumPy alone."""
