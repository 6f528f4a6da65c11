"""ROS 2 over plain DDS, with no ROS installed."""
