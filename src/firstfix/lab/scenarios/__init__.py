"""Scripts of what happens to a robot."""
