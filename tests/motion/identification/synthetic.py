"""Static measurements of a robot made from its true body and the simulator's sensor errors, without physics."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.materials import GRAVITY
from tulip_description.model import Side, floating_model, joint_indices, sole_model
from tulip_description.robot import HEAD_JOINTS, Robot
from tulip_motion.identification.static_measurement import StaticMeasurement
from tulip_sim.parameters import SensorParameters
from tulip_sim.sensors import cell_forces

Array = NDArray[np.float64]
Held = list[tuple[Side, Array]]
"""Stance foot and true joint positions (n,) [rad] of postures."""
READINGS = 250
SOLE_TILT = 0.001  # [rad] the floor is not quite level, nor the sole quite flat


def com_by_pinocchio(robot: Robot, side: Side, joints: Array) -> Array:
    """Return the CoM (3,) of the whole robot in a sole frame, by Pinocchio's free-flyer model."""
    model = floating_model(robot)
    data = model.createData()
    q = pin.neutral(model)
    q[7:] = joints
    pin.framesForwardKinematics(model, data, q)
    sole = data.oMf[model.getFrameId("l_sole" if side == "left" else "r_sole")]
    return np.array(sole.actInv(pin.centerOfMass(model, data, q)))


def base_rotation(robot: Robot, side: Side, joints: Array) -> Array:
    """Return the rotation (3, 3) from base_link to a sole frame."""
    model = sole_model(robot, side)
    data = model.createData()
    q = np.empty(model.nq)
    q[joint_indices(model, robot)] = joints
    pin.framesForwardKinematics(model, data, q)
    return np.array(data.oMf[model.getFrameId("base_link")].rotation)


def random_posture(robot: Robot, side: Side, rng: np.random.Generator) -> Array:
    """Draw a posture on one foot: knees bent, trunk within 0.8 rad of upright, believed CoM above the middle sole."""
    low, high = robot.position_limits
    stance = 0 if side == "left" else 6
    swing, ankle = 6 - stance, [stance + 4, stance + 5]
    out = 1.0 if side == "left" else -1.0  # a positive hip roll takes the right leg inwards
    for _ in range(2000):
        joints = np.zeros(len(robot.joint_names))
        for leg in (stance, swing):
            joints[leg : leg + 6] = rng.uniform(-1.0, 1.0, 6) * (0.5, 0.3, 0.9, 0.9, 0.5, 0.5)
            joints[leg + 2] -= 0.5
            joints[leg + 3] += 1.0
        joints[swing + 1] -= out * 0.2
        joints[stance + 4] = -joints[stance + 2] - joints[stance + 3]
        for index, name in enumerate(robot.joint_names):
            if name in HEAD_JOINTS:
                joints[index] = rng.uniform(0.9 * low[index], 0.9 * high[index])
        target = np.array([rng.uniform(0.01, 0.08), rng.uniform(-0.03, 0.03)])
        for _ in range(15):
            error = target - com_by_pinocchio(robot, side, joints)[:2]
            steps = []
            for index in ankle:
                moved = joints.copy()
                moved[index] += 1e-5
                steps.append((com_by_pinocchio(robot, side, moved)[:2] - target + error) / 1e-5)
            change = np.linalg.solve(np.array(steps).T, error)
            joints[ankle] += np.clip(change, -0.2, 0.2)
            if np.abs(error).max() < 1e-6:
                break
        else:
            continue
        upright = base_rotation(robot, side, joints)[2, 2] > math.cos(0.8)
        if upright and (joints > low).all() and (joints < high).all():
            return joints
    raise AssertionError("no posture found")


def postures(robot: Robot, count: int, rng: np.random.Generator) -> Held:
    """Draw postures, on the left and the right foot in turn."""
    sides: tuple[Side, Side] = ("left", "right")
    return [(sides[i % 2], random_posture(robot, sides[i % 2], rng)) for i in range(count)]


def measure(
    truth: Robot,
    held: Held,
    rng: np.random.Generator,
    sensors: SensorParameters | None = None,
    cell_order: tuple[int, ...] = (0, 1, 2, 3),
) -> list[StaticMeasurement]:
    """Return what the sensors of a robot tell of postures that it holds.

    Args:
        truth: Its true body.
        held: Stance foot and true joint positions (n,) of each posture.
        rng: Of the sensors' errors; the IMU's mounting error is the same for all postures.
        sensors: Sizes of the errors.
        cell_order: Which cell each wire comes from; other than 0 to 3 is a mistake.
    """
    p = sensors or SensorParameters()
    bias = p.attitude_bias * rng.standard_normal(2)
    found = []
    for side, joints in held:
        foot = truth.feet[0 if side == "left" else 1]
        tilt = SOLE_TILT * rng.standard_normal(2)
        down = np.array([tilt[0], tilt[1], -1.0])
        down /= np.linalg.norm(down)
        com = com_by_pinocchio(truth, side, joints)
        cop = com[:2] - down[:2] / down[2] * com[2]
        weight = truth.mass * GRAVITY * -down[2]
        true_cells = np.array(cell_forces(foot, [(float(cop[0]), float(cop[1]), weight)]))
        noisy = true_cells + p.cell_noise * rng.standard_normal((READINGS, 4))
        step = p.cell_step or 1e-12
        forces = np.maximum(np.round(noisy / step) * step, 0.0)[:, list(cell_order)]
        encoders = joints + p.encoder_noise * rng.standard_normal((READINGS, len(joints)))
        if p.encoder_step:
            encoders = np.round(encoders / p.encoder_step) * p.encoder_step
        attitude = p.attitude_noise / math.sqrt(READINGS) * rng.standard_normal(3)
        turned = np.append(bias, 0.0) + attitude
        in_base = pin.exp3(-turned) @ base_rotation(truth, side, joints).T @ down
        found.append(_averaged(side, encoders.mean(axis=0), in_base, forces, np.array(foot.cells)))
    return found


def _averaged(side: Side, joints: Array, down: Array, forces: Array, cells: Array) -> StaticMeasurement:
    mean, variance = forces.mean(axis=0), forces.var(axis=0, ddof=1) / len(forces)
    variance = np.maximum(variance, 1e-8)
    total = float(mean.sum())
    cop = mean @ cells / total
    change = (cells - cop) / total
    return StaticMeasurement(
        side, joints, down / np.linalg.norm(down), cop, change.T @ np.diag(variance) @ change, mean
    )
