"""Messages of robots' logs (ROS, JSON) as tables of columns: one table a topic."""
