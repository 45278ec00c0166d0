"""Logs of a robot in motion made by Pinocchio's inverse dynamics with a true body, without physics engine or filter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot
from tulip_motion.identification.motion_log import MotionLog
from tulip_motion.identification.zmp_regressor import BodyMotion, Ground, ZmpRegressor, horizontal_axes, parameters_of
from tulip_motion.identification.zmp_rows import Biases, ZmpRows

Array = NDArray[np.float64]
PERIOD = 0.004
REST = 1.5  # [s] before the motion and after it


def changed(robot: Robot, rng: np.random.Generator) -> Robot:
    """Return a robot with other masses, CoMs and inertias, by up to 20 % and 2 cm."""
    links = []
    for link in robot.links:
        scale = float(rng.uniform(0.8, 1.2))
        x, y, z = (np.array(link.com) + rng.uniform(-0.02, 0.02, 3)).tolist()
        a, b, c = link.inertia
        links.append(replace(link, mass=link.mass * scale, com=(x, y, z), inertia=(a * scale, b * scale, c * scale)))
    return replace(robot, links=tuple(links))


def swaying_log(
    true: Robot,
    seconds: float = 12.0,
    joint_amplitude: float = 0.15,
    trunk_amplitude: float = 0.05,
    on_one_foot: bool = True,
    friction: tuple[Array, Array, float] | None = None,
    spreads: tuple[float, float] = (0.0, 0.0),
) -> MotionLog:
    """Return what perfect sensors would say of a robot that moves all joints, its trunk rocking and shaking.

    Newton and Euler do not ask what the soles do, so the feet need not stay where they are: the ground's wrench is put
    where it belongs on the plane of the left sole, and its cells are given what they would feel there.

    Args:
        true: The robot's body.
        seconds: Of motion, between two rests.
        joint_amplitude: [rad].
        trunk_amplitude: Of its rocking [rad], and of its way by ten times less [m].
        on_one_foot: The right foot carries nothing; else each foot a half.
        friction: Coulomb (n,) [N m] and viscous (n,) [N m s/rad] of the joints, and the Coulomb speed [rad/s].
        spreads: By how much the cells sit too far in.
    """
    model = floating_model(true)
    data = model.createData()
    posture = standing_posture(true).joint_positions
    n, count = len(posture), round((seconds + 2 * REST) / PERIOD)
    phases = np.random.default_rng(5).uniform(0.0, 2.0 * np.pi, (2, n + 6))
    slow, fast = np.linspace(0.23, 0.61, n + 6), np.linspace(0.71, 1.37, n + 6)[::-1]

    def coordinates(t: float) -> Array:
        since = t - REST
        fade = _rise(since / 1.5) * _rise((seconds - since) / 1.5)
        sines = np.sin(2 * np.pi * slow * since + phases[0]) + 0.6 * np.sin(2 * np.pi * fast * since + phases[1])
        return fade * sines

    def configuration(t: float) -> Array:
        moved = coordinates(t)
        rotation = pin.exp3(trunk_amplitude * moved[3:6])
        base = 0.1 * trunk_amplitude * moved[:3]
        return np.concatenate([base, pin.Quaternion(rotation).coeffs(), posture + joint_amplitude * moved[6:]])

    h = 1e-4
    imu = np.array(true.imu.origin)
    columns: dict[str, list[Array]] = {name: [] for name in MotionLog.__dataclass_fields__ if name != "period"}
    cells = np.array([foot.cells for foot in true.feet])
    middles = cells.mean(axis=1, keepdims=True)
    real_cells = middles + (cells - middles) * (1.0 + np.array(spreads))
    for k in range(count):
        t = PERIOD * k
        before, q, after = (configuration(t + dt) for dt in (-h, 0.0, h))
        rate_0, rate_1 = pin.difference(model, before, q) / h, pin.difference(model, q, after) / h
        v, a = 0.5 * (rate_0 + rate_1), (rate_1 - rate_0) / h
        wanted = pin.rnea(model, data, q, v, a)
        rotation = pin.Quaternion(q[3:7]).matrix()
        force, moment = wanted[:3], wanted[3:6]
        up, turning, change = rotation[2], v[3:6], a[3:6]
        base_force = a[:3] + np.cross(turning, v[:3]) + 9.81 * up
        pin.framesForwardKinematics(model, data, np.concatenate([[0, 0, 0, 0, 0, 0, 1], q[7:]]))
        soles = [data.oMf[model.getFrameId(name)] for name in ("l_sole", "r_sole")]
        shares = (1.0, 0.0) if on_one_foot else (0.5, 0.5)
        columns["foot_cells"].append(_cells(force, moment, up, soles, shares, real_cells))
        columns["joint_positions"].append(q[7:])
        efforts = wanted[6:].copy()
        if friction is not None:
            efforts += friction[0] * np.tanh(v[6:] / friction[2]) + friction[1] * v[6:]
        columns["joint_efforts"].append(efforts)
        columns["base_rotations"].append(rotation)
        columns["angular_velocity"].append(turning)
        columns["specific_force"].append(base_force + np.cross(change, imu) + np.cross(turning, np.cross(turning, imu)))
    assert n == posture.size
    return MotionLog(PERIOD, **{name: np.array(values) for name, values in columns.items()})


def still_rows(true: Robot, rng: np.random.Generator, postures: int, force_error: float) -> ZmpRows:
    """Return a long quasi-static recording: 6 s in each of many postures, as the static experiment has them.

    The CoP errs by 1 mm from row to row, the force by 1 N, and by `force_error` [N], up or down, as long as a posture
    lasts: cells of unlike gains.
    """
    regressor, parameters = ZmpRegressor(true), parameters_of(floating_model(true))
    standing, none, each = standing_posture(true).joint_positions, np.zeros(3), 150
    still = np.zeros(len(standing))
    rows, forces = [], []
    for _ in range(postures):
        up = np.array([*rng.normal(scale=0.1, size=2), 1.0])
        up /= np.linalg.norm(up)
        motion = BodyMotion(standing + rng.uniform(-0.3, 0.3, len(standing)), still, still, none, none, 9.81 * up)
        at_origin = Ground(up, horizontal_axes(up), none, none, np.zeros((3, 2)), 1.0)
        exact = regressor.rows(motion, at_origin)
        x, y, force = exact @ parameters
        noisy = np.repeat(exact[None], each, axis=0)
        # A CoP that moves by d across the vertical takes d times the force off the moments.
        noisy[:, :2] -= (np.array([x, y]) / force + rng.normal(scale=1e-3, size=(each, 2)))[:, :, None] * exact[2]
        rows.append(noisy)
        forces.append(force + force_error * rng.choice([-1.0, 1.0]) + rng.normal(size=each))
    count = each * postures
    unbiased = Biases(np.eye(3), none, none)
    return ZmpRows(
        0.04 * np.arange(count),
        np.concatenate(rows),
        np.zeros((count, 2, 2)),
        np.concatenate(forces),
        np.zeros((count, 2)),
        unbiased,
    )


def _cells(
    force: Array, moment: Array, up: Array, soles: list[pin.SE3], shares: tuple[float, float], cells: Array
) -> Array:
    """Return (2, 4) forces whose common centre, on the soles, is where the wrench has no horizontal moment."""
    vertical = float(up @ force)
    result = np.zeros((2, 4))
    # The point r = o + x e_x + y e_y with u x (M - r x F) = 0; two of the three rows are independent.
    origin = shares[0] * soles[0].translation + shares[1] * soles[1].translation
    axes = shares[0] * soles[0].rotation[:, :2] + shares[1] * soles[1].rotation[:, :2]
    rows = np.stack([np.cross(up, np.cross(axis, force)) for axis in axes.T], axis=1)
    away = np.linalg.lstsq(rows, np.cross(up, moment - np.cross(origin, force)), rcond=None)[0]
    for foot, share in enumerate(shares):
        if share > 0.0:
            x, y = cells[foot].T
            design = np.stack([np.ones(4), x, y])
            result[foot] = share * vertical * np.linalg.lstsq(design, np.array([1.0, *away]), rcond=None)[0]
    return result


def _rise(share: float) -> float:
    s = min(max(share, 0.0), 1.0)
    return float(s**3 * (10.0 - s * (15.0 - 6.0 * s)))
