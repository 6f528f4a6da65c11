"""Find a robot anywhere in its map from one 2D LIDAR scan, without motion."""

__version__ = "0.1.0"
