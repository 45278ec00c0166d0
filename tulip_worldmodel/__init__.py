"""Where the robot, the ball and the opponents are."""
