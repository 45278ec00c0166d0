"""The standing posture: feet flat and parallel, trunk upright, knees bent."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.robot import HEAD_JOINTS, Robot

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Posture:
    """A posture on flat ground.

    Attributes:
        joint_positions: (n,) [rad], order of `robot.joint_names`.
        base_height: Of base_link above the ground [m].
        base_x: Of base_link ahead of the point midway between the soles [m].
    """

    joint_positions: Array
    base_height: float
    base_x: float


def standing_posture(
    robot: Robot, hip_height: float = 0.575, feet_distance: float = 0.24, com_ahead: float = 0.040
) -> Posture:
    """Return the posture in which the robot stands.

    Args:
        robot: Any variant.
        hip_height: Of the hip-pitch axes above the ground [m].
        feet_distance: Between the sole frames, sideways [m].
        com_ahead: Of the CoM before the sole frames [m]; 0.040 is near the middle of the sole [trial].

    Raises:
        ValueError: if the legs cannot reach that.
    """
    model = floating_model(robot)
    data = model.createData()
    hip_x = 0.0  # of the hip-pitch axes, ahead of the ankles
    for _ in range(20):  # moving the hips moves the CoM a little less, so the iteration contracts
        joints, base_height, base_x = _stand(robot, hip_height, feet_distance, hip_x)
        q = np.concatenate([[base_x, 0.0, base_height, 0.0, 0.0, 0.0, 1.0], joints])
        error = com_ahead - float(pin.centerOfMass(model, data, q)[0])
        if abs(error) < 1e-9:
            return Posture(joints, base_height, base_x)
        hip_x += error
    raise ValueError(
        f"no posture has the CoM {com_ahead} m ahead of the soles {frames.LEFT_SOLE} and {frames.RIGHT_SOLE}"
    )


def _stand(robot: Robot, hip_height: float, feet_distance: float, hip_x: float) -> tuple[Array, float, float]:
    yaw, roll, pitch, knee, ankle = (
        robot.joint(f"left_{part}") for part in ("hip_yaw", "hip_roll", "hip_pitch", "knee", "ankle_pitch")
    )
    sole = robot.soles[0].origin
    # In the frontal plane the leg turns about the hip-roll axis, with the hip-pitch axis on the way.
    sideways, above = feet_distance / 2 - yaw.origin[1], hip_height + sole[2]
    offset = pitch.origin[1]
    # Leg length seen from the hip-pitch axis and roll angle: R_x(roll) (offset, -length) = (sideways, -(above + drop)).
    roll_angle = 0.0
    for _ in range(30):
        hip_rise = -(
            math.sin(roll_angle) * offset + math.cos(roll_angle) * pitch.origin[2]
        )  # roll axis above the pitch axis
        length = math.sqrt(max(sideways**2 + (above + hip_rise) ** 2 - offset**2, 1e-9)) + pitch.origin[2]
        roll_angle = math.atan2(sideways, above + hip_rise) - math.atan2(offset, length - pitch.origin[2])
    reach = math.hypot(hip_x, length)
    thigh, shank = -knee.origin[2], -ankle.origin[2]
    if not abs(thigh - shank) < reach < thigh + shank:
        raise ValueError(
            f"hip_height is {hip_height} m with feet_distance {feet_distance} m; expected a hip that legs of"
            f" {thigh + shank} m reach with bent knees"
        )
    bend = math.pi - math.acos((thigh**2 + shank**2 - reach**2) / (2 * thigh * shank))
    at_hip = math.acos((thigh**2 + reach**2 - shank**2) / (2 * thigh * reach))
    hip_pitch = math.atan2(hip_x, length) - at_hip  # negative takes the thigh forward
    ankle_pitch = -hip_pitch - bend
    left = [0.0, roll_angle, hip_pitch, bend, ankle_pitch, -roll_angle]
    right = [0.0, -roll_angle, hip_pitch, bend, ankle_pitch, roll_angle]
    head = [0.0] * len(HEAD_JOINTS) if len(robot.joint_names) > len(left + right) else []
    base_height = hip_height + hip_rise - roll.origin[2] - yaw.origin[2]
    base_x = hip_x - yaw.origin[0] - roll.origin[0] - pitch.origin[0]
    return np.array(left + right + head), base_height, base_x
