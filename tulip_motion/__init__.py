"""Walking, kicking, balance, odometry and head movement."""
