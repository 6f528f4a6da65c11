"""ROS parameter files."""
