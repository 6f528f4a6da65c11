"""ROS 2 over rclpy."""
