"""ROS 1, ROS 2 and DDS nodes over one transport-independent node."""
