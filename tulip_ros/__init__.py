"""What the ROS side of every component shares: topics, parameters, running, launching and recording."""
