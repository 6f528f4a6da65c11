"""A service that locates many robots in many maps."""
