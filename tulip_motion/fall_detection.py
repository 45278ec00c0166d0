"""Recognizes a fall while there is still time to go limp, and when the robot has been set upright again.

A tilt alone tells late: at 0.7 rad the robot is on the ground within 0.06 s. Two signs tell earlier:

- The tilt that the torso will have a moment later, tilt + horizon * rate as vectors in the horizontal plane: a torso
  that turns at 2 rad/s is lost although it still stands straight.
- The DCM further from the feet than any foothold that the legs can reach: no step can catch it, whatever the torso
  does. As it comes from the joints, the IMU has to agree that the torso leans or begins to.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]
Places = Sequence[Sequence[float]]
"""(x, y, z) of the left and the right sole in odom [m]."""


class FallDetector:
    """Looks at every tick; a sign counts when it has lasted `fall_confirm_time`."""

    def __init__(self, parameters: MotionParameters) -> None:
        self._parameters = parameters
        self._ticks = max(1, round(parameters.fall_confirm_time / parameters.control_period))
        self._falling = 0
        self._upright = 0

    def is_falling(self, rotation: Array, angular_velocity: Array, dcm: tuple[float, float], soles: Places) -> str:
        """Return why the robot falls, in words, or "" as long as it may stay up.

        Args:
            rotation: (3, 3) from base_link to odom.
            angular_velocity: (3,) of base_link, odom axes [rad/s].
            dcm: (x, y) in odom [m].
            soles: Places of the left and the right one in odom [m].
        """
        p = self._parameters
        tilt, predicted = predicted_tilt(rotation, angular_velocity, p.fall_horizon)
        reason = ""
        if predicted > p.fall_tilt:
            reason = (
                f"falls: the torso leans {math.degrees(tilt):.0f} deg and"
                f" {math.degrees(predicted):.0f} deg in {p.fall_horizon:g} s"
            )
        elif predicted > p.fall_lean:
            forward, left = beyond_feet(rotation, dcm, soles, p.zmp_forward)
            if math.hypot(forward / p.fall_reach_forward, left / p.fall_reach_side) > 1.0:
                reason = (
                    f"falls: the torso leans {math.degrees(tilt):.0f} deg and the DCM is"
                    f" {math.hypot(forward, left):.2f} m from the feet, beyond every foothold"
                )
        self._falling = self._falling + 1 if reason else 0
        return reason if self._falling >= self._ticks else ""

    def is_upright(self, rotation: Array, angular_velocity: Array, height: float, loads: tuple[float, float]) -> bool:
        """Return whether a robot that fell has been set on its feet.

        Args:
            rotation: (3, 3) from base_link to odom.
            angular_velocity: (3,) of base_link, odom axes [rad/s].
            height: Of base_link above the lower sole [m].
            loads: Vertical force on the left and right sole [N].
        """
        p = self._parameters
        tilt, predicted = predicted_tilt(rotation, angular_velocity, p.fall_horizon)
        stands = max(tilt, predicted) < p.upright_tilt and height > p.upright_height and min(loads) > p.contact_force
        self._upright = self._upright + 1 if stands else 0
        if self._upright < self._ticks:
            return False
        self._falling = self._upright = 0
        return True


def predicted_tilt(rotation: Array, angular_velocity: Array, horizon: float) -> tuple[float, float]:
    """Return the tilt [rad] now, and after a time [s] at the present rate.

    Args:
        rotation: (3, 3) from base_link to odom.
        angular_velocity: (3,) of base_link, odom axes [rad/s].
        horizon: [s].
    """
    up_x, up_y, up_z = rotation[:, 2].tolist()
    omega_x, omega_y, omega_z = angular_velocity.tolist()
    across = math.hypot(up_x, up_y)
    tilt = math.atan2(across, up_z)
    scale = tilt / across if across > 1e-9 else 1.0
    # The up axis moves with omega x up; only its horizontal part leans.
    rate_x, rate_y = omega_y * up_z - omega_z * up_y, omega_z * up_x - omega_x * up_z
    return tilt, math.hypot(scale * up_x + horizon * rate_x, scale * up_y + horizon * rate_y)


def beyond_feet(rotation: Array, dcm: tuple[float, float], soles: Places, zmp_forward: float) -> tuple[float, float]:
    """Return how far the DCM is from the line between the feet: forward and left of the torso [m].

    Args:
        rotation: (3, 3) from base_link to odom.
        dcm: (x, y) in odom [m].
        soles: Places of the left and the right one in odom [m].
        zmp_forward: Middle of a sole ahead of its ankle [m].
    """
    yaw = math.atan2(rotation[1, 0], rotation[0, 0])
    c, s = math.cos(yaw), math.sin(yaw)
    ahead_x, ahead_y = zmp_forward * c, zmp_forward * s
    (ax, ay), (bx, by) = ((sole[0] + ahead_x, sole[1] + ahead_y) for sole in soles)
    way_x, way_y = bx - ax, by - ay
    share = ((dcm[0] - ax) * way_x + (dcm[1] - ay) * way_y) / max(way_x**2 + way_y**2, 1e-9)
    share = min(max(share, 0.0), 1.0)
    dx, dy = dcm[0] - ax - share * way_x, dcm[1] - ay - share * way_y
    return c * dx + s * dy, -s * dx + c * dy
