"""Ten minutes of walking by inverse kinematics alone: closed loop, it does not drift."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.gait import FootMotion
from tulip_motion.interface import Side
from tulip_motion.inverse_kinematics import InverseKinematics, TaskTarget, rotation_z
from tulip_motion.motion import with_fixed_head

DT = 0.004
STEP_TICKS = 112  # of 0.448 s
STEPS = 1340  # 10 min
STRIDE, WIDTH, LIFT = 0.12, 0.24, 0.045  # [m]
TURN = 0.02  # [rad] a step: the way is a circle of 6 m, so that places and headings repeat little
SWAY, HEIGHT = 0.06, 0.70  # [m]


@dataclass
class Step:
    """One step on the circle: exact derivatives of every reference, so that only CLIK's own error remains."""

    index: int

    @property
    def stance(self) -> Side:
        return Side(self.index % 2)

    def foot(self, index: int) -> Pose2D:
        """Where the foot of step `index` stands."""
        heading, radius = TURN * index, STRIDE / TURN
        side = 0.5 * WIDTH if Side(index % 2) is Side.LEFT else -0.5 * WIDTH
        centre = Pose2D(radius * math.sin(heading), radius * (1.0 - math.cos(heading)), heading)
        return centre @ Pose2D(0.0, side)

    def target(self, tick: int) -> TaskTarget:
        s = tick / STEP_TICKS
        rate = 1.0 / (STEP_TICKS * DT)
        w = 2.0 * math.pi
        glide, glide_rate = s - math.sin(w * s) / w, rate * (1.0 - math.cos(w * s))
        start, end = self.foot(self.index - 1), self.foot(self.index + 1)
        way = np.array([end.x - start.x, end.y - start.y, 0.0])
        lift = 0.5 * LIFT * (1.0 - math.cos(w * s))
        lift_rate = 0.5 * LIFT * w * rate * math.sin(w * s)
        yaw = 2.0 * TURN
        other = FootMotion(
            np.array([start.x, start.y, lift]) + glide * way,
            glide_rate * way + np.array([0.0, 0.0, lift_rate]),
            np.zeros(3),
            start.yaw + glide * yaw,
            glide_rate * yaw,
        )
        phase = self.index - 0.5 + s
        heading, heading_rate, radius = TURN * phase, TURN * rate, STRIDE / TURN
        # Steps with an even index stand on the left foot: there the CoM sways to the left.
        sway, sway_rate = (
            SWAY * math.sin(math.pi * (phase + 0.5)),
            SWAY * math.pi * rate * math.cos(math.pi * (phase + 0.5)),
        )
        out = radius - sway
        sine, cosine = math.sin(heading), math.cos(heading)
        com = np.array([out * sine + 0.04 * cosine, radius - out * cosine + 0.04 * sine, HEIGHT])
        ahead = out * heading_rate
        velocity = np.array(
            [
                ahead * cosine - sway_rate * sine - 0.04 * heading_rate * sine,
                ahead * sine + sway_rate * cosine + 0.04 * heading_rate * cosine,
                0.0,
            ]
        )
        return TaskTarget(com, velocity, rotation_z(heading), np.array([0.0, 0.0, heading_rate]), other)


def largest_errors(kinematics: InverseKinematics, step: Step, ticks: range) -> np.ndarray:
    """Walk; return the largest errors: stance sole [m], its turn [rad], CoM [m], torso [rad], other sole [m], [rad]."""
    worst = np.zeros(6)
    stance, anchor = step.stance, step.foot(step.index)
    home, level = np.array([anchor.x, anchor.y, 0.0]), rotation_z(anchor.yaw)
    for tick in ticks:
        target = step.target(tick)
        kinematics.update_jacobian(stance)
        kinematics.solve_velocity(target)
        if tick % 14 == 7:  # measuring takes longer than walking
            soles = [kinematics.data.oMf[frame] for frame in kinematics.sole_frames]
            fixed, moving = soles[stance], soles[stance.other]
            errors = (
                fixed.translation - home,
                pin.log3(fixed.rotation @ level.T),
                kinematics.data.com[0] - target.com,
                pin.log3(kinematics.data.oMi[1].rotation @ target.torso_rotation.T),
                moving.translation - target.foot.position,
                pin.log3(moving.rotation @ rotation_z(target.foot.yaw).T),
            )
            worst = np.maximum(worst, [np.linalg.norm(error) for error in errors])
        kinematics.integrate(DT, anchor)
    return worst


def test_ten_minutes_of_walking_end_as_exact_as_they_began() -> None:
    robot = with_fixed_head(load_robot())
    posture = standing_posture(load_robot())
    kinematics = InverseKinematics(floating_model(robot), 20.0, 20.0, robot.position_limits[:, :12])
    kinematics.reset(np.eye(3), np.array([0.0, 0.0, posture.base_height]), posture.joint_positions[:12])
    first = Step(0)
    for _ in range(500):  # come to where the walk begins
        kinematics.update_jacobian(first.stance)
        kinematics.solve_velocity(first.target(0))
        kinematics.integrate(DT, first.foot(0))
    errors = np.array([largest_errors(kinematics, Step(i), range(STEP_TICKS)) for i in range(STEPS)])
    start, end = errors[2:22].max(axis=0), errors[-20:].max(axis=0)
    # In the order of largest_errors: what one Euler step leaves, a dt^2 / 2 of each task, times a few ticks of lag.
    assert np.all(errors[2:].max(axis=0) < [1e-5, 1e-9, 4e-4, 1e-4, 1e-3, 2e-4])
    np.testing.assert_allclose(end, start, rtol=1e-4, atol=1e-9)
    assert kinematics.notes == ()
