"""ROS messages to core types and back, with no ROS imported."""
