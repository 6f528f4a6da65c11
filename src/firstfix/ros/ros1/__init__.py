"""ROS 1 over rospy."""
