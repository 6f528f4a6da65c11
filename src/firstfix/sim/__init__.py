"""A robot to try it on."""
