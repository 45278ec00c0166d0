"""Simulator: physics, sensors, camera, referee, and the driver that offers them as the robot's body."""
