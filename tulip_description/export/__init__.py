"""The robot, the field and the ball as files for other programs: URDF, SDF and MJCF."""
