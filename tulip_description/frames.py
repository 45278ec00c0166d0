"""Names of the coordinate frames (REP 105 for mobile bases, REP 120 for humanoids).

Axes follow REP 103: x forward, y left, z up, right-handed; yaw is positive to the left.
"""

MAP = "map"
"""Field frame: origin at the field's centre on the ground, x towards the goal that the robot attacks."""
ODOM = "odom"
"""Dead-reckoning frame: drifts, never jumps; z = 0 is the ground."""
BASE_FOOTPRINT = "base_footprint"
"""base_link projected onto the ground, with the yaw of base_link only."""
BASE_LINK = "base_link"
"""The trunk's own frame (see robot.yaml)."""
LEFT_SOLE = "l_sole"
RIGHT_SOLE = "r_sole"
"""Points on the ground below the ankles when the feet stand flat."""
IMU = "imu_link"
CAMERA = "camera_link"
"""At the camera's optical centre, x along the optical axis."""
CAMERA_OPTICAL = "camera_optical_frame"
"""At the camera's optical centre, z along the optical axis, x to the right, y down (REP 103)."""
