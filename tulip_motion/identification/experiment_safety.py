"""What ends the experiment early: signs that the robot may fall or breaks something."""

from __future__ import annotations

import math
from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot
from tulip_description.robot_io import Sensors
from tulip_motion.fall_detection import predicted_tilt
from tulip_motion.identification.averaging import up_in_base
from tulip_motion.identification.one_foot_control import BodyOnFeet
from tulip_motion.identification.passages import ALONE, Doing, Passage
from tulip_motion.lipm import GRAVITY

Array = NDArray[np.float64]


@dataclass(frozen=True)
class SafetyParameters:
    """Limits; a sign has to last before it counts, since single readings are noisy."""

    lasting: float = 0.15  # [s]
    lean_error: float = 0.15  # [rad] of the trunk against the joints: the sole has tilted
    edge: float = 0.012  # [m] of the CoP from the edge of the stance sole at least
    torque_share: float = 0.95  # of a joint's limit
    joint_error: float = 0.2  # [rad] between an encoder and where the joint shall be
    range_margin: float = 0.02  # [rad] an encoder may be beyond its joint's range
    least_load: float = 0.6  # of the robot's weight on its feet
    touch: float = 25.0  # [N] on the foot that shall be in the air
    lost_sole: float = 0.35  # [rad] the same, when it is too late for anything but going limp
    falling: float = 1.0  # [rad] of the trunk's tilt, now or in a moment, likewise; postures lean by 0.74 at most
    horizon: float = 0.2  # [s] that moment


class Watch:
    """Looks at every reading."""

    def __init__(self, robot: Robot, parameters: SafetyParameters, period: float) -> None:
        """Begin.

        Args:
            robot: Limits and soles.
            parameters: What is too much.
            period: Between two readings [s].
        """
        self._parameters, self._robot = parameters, robot
        self._ticks = max(1, round(parameters.lasting / period))
        self._low, self._high = robot.position_limits
        self._torques = parameters.torque_share * robot.effort_limits
        self._least_load = parameters.least_load * robot.mass * GRAVITY
        self._lasting: Counter[str] = Counter()

    def is_falling(self, sensors: Sensors, body: BodyOnFeet) -> bool:
        """Return whether the robot can no longer be held.

        Args:
            sensors: The reading.
            body: What follows from it.
        """
        p = self._parameters
        rotation = quaternion_matrix(sensors.imu_orientation.tolist())
        tilt, predicted = predicted_tilt(rotation, rotation @ sensors.imu_angular_velocity, p.horizon)
        return max(tilt, predicted) > p.falling or lean_error(sensors, body) > p.lost_sole

    def fault(self, sensors: Sensors, body: BodyOnFeet, passage: Passage, wanted: Array) -> str:
        """Return why the experiment has to end, in words, or "".

        Args:
            sensors: The reading.
            body: What follows from it.
            passage: What the robot does.
            wanted: (n,) where the joints shall be [rad].
        """
        signs = self._signs(sensors, body, passage, wanted)
        self._lasting = Counter({kind: self._lasting[kind] + 1 for kind in signs})
        lasting = [kind for kind, ticks in self._lasting.items() if ticks >= self._ticks]
        return signs[lasting[0]] if lasting else ""

    def _signs(self, sensors: Sensors, body: BodyOnFeet, passage: Passage, wanted: Array) -> dict[str, str]:
        """Return what is wrong with one reading: the kind, and in words."""
        p, names, stance = self._parameters, self._robot.joint_names, passage.stance
        found: dict[str, str] = {}
        angles = sensors.joint_positions
        outside = np.maximum(self._low - angles, angles - self._high)
        if not (np.isfinite(angles).all() and outside.max() < p.range_margin):
            worst = int(np.nanargmax(np.where(np.isfinite(angles), outside, np.inf)))
            found["range"] = f"the encoder of {names[worst]} reads {angles[worst]:.2f} rad, out of its range"
        error = np.abs(angles - wanted)
        if error.max() > p.joint_error:
            worst = int(error.argmax())
            found["error"] = f"{names[worst]} is {error[worst]:.2f} rad away from where it shall be"
        efforts = np.abs(sensors.joint_efforts)
        if (efforts > self._torques).any():
            worst = int(np.argmax(efforts / self._torques))
            found["torque"] = f"{names[worst]} takes {efforts[worst]:.0f} N m, its limit"
        lean = lean_error(sensors, body)
        if lean > p.lean_error:
            found["lean"] = f"the trunk leans {lean:.2f} rad more than the joints say: the sole has tilted"
        if body.loads.sum() < self._least_load:
            found["load"] = f"the feet carry {body.loads.sum():.0f} N: they have lost the ground"
        elif passage.shares == (ALONE, ALONE):
            foot = self._robot.feet[stance]
            room = min(
                body.cop[0] - foot.x[0], foot.x[1] - body.cop[0], body.cop[1] - foot.y[0], foot.y[1] - body.cop[1]
            )
            if room < p.edge:
                found["edge"] = f"the CoP is {1e3 * room:.0f} mm from the edge of the sole"
        touch = body.loads[stance.other]
        if passage.doing in (Doing.MOVE, Doing.HOLD) and touch > p.touch:
            found["touch"] = f"the foot in the air touches something with {touch:.0f} N"
        return found


def lean_error(sensors: Sensors, body: BodyOnFeet) -> float:
    """Return the angle between up by the IMU and up by the joints, the stance sole lying level [rad]."""
    return math.acos(min(1.0, float(up_in_base(sensors) @ body.up)))
