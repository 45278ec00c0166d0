"""How the two head joints point the camera, for a robot that stands or walks upright."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from tulip_description.posture import standing_posture
from tulip_description.robot import HEAD_JOINTS, Robot

Array = NDArray[np.float64]


class HeadGeometry:
    """The neck of a robot in its standing posture.

    Attributes:
        lower, upper: (2,) limits of pan and tilt, a margin inside the joints' stops [rad].
        fastest: (2,) what the joints can do [rad/s].
    """

    def __init__(self, robot: Robot, margin: float) -> None:
        """Measure a robot.

        Args:
            robot: A robot with a head; it is taken to stand upright in its standing posture.
            margin: Kept from the joints' stops [rad].

        Raises:
            ValueError: if the robot has no head.
        """
        if robot.camera is None:
            raise ValueError(f"variant {robot.variant!r} has no head; expected the playing variant")
        pan, tilt = (robot.joint(name) for name in HEAD_JOINTS)
        self.lower = np.array([pan.lower, tilt.lower]) + margin
        self.upper = np.array([pan.upper, tilt.upper]) - margin
        self.fastest = np.array([pan.velocity, tilt.velocity])
        self._neck = np.array([pan.origin[0], pan.origin[1], pan.origin[2] + standing_posture(robot).base_height])
        self._tilt_axis = np.array(tilt.origin)  # in the neck's frame; it crosses the pan axis (y = 0)
        self._camera = np.array(robot.camera.origin)  # in the head

    @property
    def eye(self) -> Array:
        """(3,) on the pan axis at the camera's height in base_footprint [m]: the camera turns round it 6 cm away."""
        above = self._tilt_axis[2] + self._camera[2]
        return np.array([self._neck[0], self._neck[1], self._neck[2] + above])

    def angles_towards(self, target: tuple[float, float, float]) -> Array:
        """Return (2,) pan and tilt [rad] that bring a point of base_footprint [m] into the middle of the picture.

        A point out of reach gives the nearest angles inside the joints' limits. With the point at (r, z) in
        the vertical plane of the tilt axis, and the optical axis a height h above that axis, the tilt t follows from
        r sin t + z cos t = h.
        """
        x, y, z = target
        offset_x, offset_y = x - float(self._neck[0]), y - float(self._neck[1])
        pan = math.atan2(offset_y, offset_x)
        ahead = math.hypot(offset_x, offset_y) - float(self._tilt_axis[0])
        above = z - float(self._neck[2]) - float(self._tilt_axis[2])
        distance = max(math.hypot(ahead, above), abs(float(self._camera[2])), 1e-6)
        tilt = math.asin(float(self._camera[2]) / distance) - math.atan2(above, ahead)
        angles: Array = np.clip(np.array([pan, tilt]), self.lower, self.upper)
        return angles

    def point_ahead(self, angles: Array, distance: float) -> tuple[float, float, float]:
        """Return the point of base_footprint [m] on the optical axis, so far from the tilt axis [m] along the axis.

        `angles_towards` leads back from the point to the angles.
        """
        pan, tilt = float(angles[0]), float(angles[1])
        height = float(self._camera[2])
        out = float(self._tilt_axis[0]) + distance * math.cos(tilt) + height * math.sin(tilt)
        up = float(self._neck[2] + self._tilt_axis[2]) - distance * math.sin(tilt) + height * math.cos(tilt)
        return float(self._neck[0]) + out * math.cos(pan), float(self._neck[1]) + out * math.sin(pan), up
