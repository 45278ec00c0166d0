"""How far a step can go, from the robot's legs, and how fast it can walk with such steps."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.robot import LEG_JOINTS, Robot
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import Side
from tulip_motion.parameters import MotionParameters

Velocity = tuple[float, float, float]
STRAIGHTEST = 0.985  # of the leg's length; a straighter knee would need endless joint speed to go on moving the hip


@dataclass(frozen=True)
class Reach:
    """Where a foot can land beside the stance foot, and the speeds that such steps allow.

    Attributes:
        stride: Greatest distance forward or back between the ankles [m].
        nearest, farthest: Least and greatest distance sideways between the ankles [m].
        turn: Greatest angle between the feet [rad].
        forward, backward, sideways, turning: Greatest speeds [m/s], [rad/s].
    """

    stride: float
    nearest: float
    farthest: float
    turn: float
    forward: float
    backward: float
    sideways: float
    turning: float

    def within(self, stance: Footstep, step: Footstep) -> Footstep:
        """Return a footstep, moved to where it can be beside the stance foot."""
        beside = stance.pose.inverse() @ step.pose
        outward = 1.0 if step.side is Side.LEFT else -1.0
        x = min(max(beside.x, -self.stride), self.stride)
        y = outward * min(max(outward * beside.y, self.nearest), self.farthest)
        return Footstep(step.side, stance.pose @ Pose2D(x, y, beside.yaw))

    def limited(self, wanted: Velocity) -> tuple[Velocity, str]:
        """Return the velocity that can be walked, and in words what was taken off, or "".

        Speeds of several directions together are limited as an ellipsoid: a long step that also turns and goes
        sideways reaches further than each alone.
        """
        most_forward = self.forward if wanted[0] >= 0.0 else self.backward
        size = math.hypot(wanted[0] / most_forward, wanted[1] / self.sideways, wanted[2] / self.turning)
        if size <= 1.0:
            return wanted, ""
        forward, left, turn = (value / size for value in wanted)
        return (forward, left, turn), (
            f"walk command clipped: ({wanted[0]:.2f}, {wanted[1]:.2f}) m/s, {wanted[2]:.2f} rad/s"
            f" to ({forward:.2f}, {left:.2f}) m/s, {turn:.2f} rad/s; limits are {self.forward:.2f} forward,"
            f" {self.backward:.2f} back, {self.sideways:.2f} sideways, {self.turning:.2f} rad/s, all together"
            " as an ellipsoid"
        )


def reach(parameters: MotionParameters, robot: Robot) -> Reach:
    """Return the reach of a robot that walks with its CoM at the height of the parameters.

    The ankle can be sqrt(l^2 - h^2) off the point below its hip, with the leg's length l and the hip's height h; a
    share of it is for walking and balance, the rest for leaning and for tracking errors.

    Raises:
        ValueError: if the CoM is too high for the legs.
    """
    p = parameters
    model = floating_model(robot)
    data = model.createData()
    pin.centerOfMass(model, data, pin.neutral(model))
    pin.updateFramePlacements(model, data)
    hip, knee, ankle = (
        data.oMi[model.getJointId(f"left_{name}")].translation for name in ("hip_pitch", "knee", "ankle_pitch")
    )
    sole = data.oMf[model.getFrameId(frames.LEFT_SOLE)].translation
    leg = STRAIGHTEST * float(np.linalg.norm(hip - knee) + np.linalg.norm(knee - ankle))
    hip_height = p.com_height - float(data.com[0][2] - hip[2]) - float(ankle[2] - sole[2])
    if hip_height >= leg:
        highest = p.com_height - hip_height + leg
        raise ValueError(
            f"com_height is {p.com_height} m; expected less than {highest:.3f} m, where the legs are straight"
        )
    way = p.reach_share * math.sqrt(leg**2 - hip_height**2)
    lowest, highest = robot.position_limits[:, LEG_JOINTS.index("left_hip_yaw")]
    turn = p.reach_share * float(highest - lowest)
    stride, farthest = 2.0 * way, 2.0 * float(hip[1]) + way
    # Sideways and turning, only every second step moves the body.
    return Reach(
        stride,
        p.min_foot_distance,
        farthest,
        turn,
        fastest_stride(p.max_speed_forward, stride, p),
        fastest_stride(p.max_speed_backward, stride, p),
        min(p.max_speed_sideways, (farthest - p.stance_width) / (2.0 * p.step_time)),
        min(p.max_turn_rate, turn / (2.0 * p.step_time)),
    )


def step_time(parameters: MotionParameters, speed: float) -> float:
    """Return the duration of a whole step [s] at a speed forward or backward [m/s]."""
    return parameters.step_time + parameters.step_time_growth * abs(speed)


def stance_width(parameters: MotionParameters, speed: float) -> float:
    """Return the distance between the feet sideways [m] at a speed forward or backward [m/s]."""
    return parameters.stance_width - parameters.stance_narrowing * abs(speed)


def fastest_stride(speed: float, stride: float, parameters: MotionParameters) -> float:
    """Return the speed [m/s], or the one at which steps are as long as the stride [m] if that is less."""
    p, growth = parameters, max(parameters.step_time_growth, 1e-9)
    return min(speed, (math.sqrt(p.step_time**2 + 4.0 * growth * stride) - p.step_time) / (2.0 * growth))
