"""What the gait tuner looks for: which parameters, within which bounds, and what makes a gait good.

A candidate is judged by randomised walks of every kind and by pushes while walking; the same seeds for all
candidates, so that they differ in the gait alone. `Figures` are means over the walks; `cost` weighs them such that
each line of this list matters only among gaits that are about equal in the lines above it:

1. survival: share of the time asked for that the robot stayed upright, in walks and among pushes (weight 100)
2. speed: what lacks of the commanded speed, as a share of it (10)
3. torque: greatest torque by its limit; only what is above three quarters of it (4)
4. joint speed: greatest joint speed by its limit; only what is above three quarters (2)
5. drift: speed across the commanded direction, and turning that was not asked for, by the commanded speed (1)
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.interface import WalkCommand, WalkMode
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench.body import Body
from tulip_sim.timing import TICK

START = Pose2D(0.0, 40.0, 0.0)  # off the field, where nothing is in the way

SPACE: dict[str, tuple[float, float]] = {
    "com_height": (0.66, 0.735),  # [m] from deep knees to almost straight ones
    "step_time": (0.34, 0.60),  # [s]
    "step_time_growth": (0.0, 0.4),  # [s/(m/s)]
    "double_support_time": (0.03, 0.12),  # [s]
    "first_shift_time": (0.3, 0.8),  # [s]
    "stop_shift_time": (0.3, 0.9),  # [s]
    "stance_width": (0.20, 0.30),  # [m] from soles 50 mm apart to the hips' width
    "stance_narrowing": (0.0, 0.1),  # [m/(m/s)]
    "swing_height": (0.03, 0.06),  # [m]
    "landing_speed": (0.05, 0.3),  # [m/s]
    "zmp_forward": (0.02, 0.06),  # [m] the sole reaches from -0.065 to 0.145
    "zmp_inward": (-0.02, 0.03),  # [m]
    "placement_freeze_time": (0.04, 0.14),  # [s]
    "placement_gain": (0.6, 1.3),
    "ankle_share": (0.4, 1.0),
    "step_time_weight": (0.0005, 0.02),  # [m^2/s^2]
    "step_place_weight": (0.0, 0.1),
    "max_step_extension": (0.0, 0.3),  # [s]
    "max_step_time_rate": (1.0, 25.0),  # [s/s]
    "outer_excess_weight": (1.0, 8.0),
    "max_swing_speed": (1.6, 3.5),  # [m/s]
    "dcm_gain": (0.5, 4.0),
    "zmp_limit_side": (0.045, 0.07),  # [m] half a sole is 0.075 m
    "observer_position_gain": (10.0, 80.0),  # [1/s]
    "observer_velocity_gain": (20.0, 160.0),  # [1/s]
    "height_stiffness": (40.0, 250.0),  # [1/s^2]
    "height_damping": (8.0, 40.0),  # [1/s]
    "torso_stiffness": (20.0, 150.0),  # [1/s^2]
    "torso_damping": (5.0, 30.0),  # [1/s]
}
"""Bounds of every parameter in gait.yaml."""

WALKS = ("forward", "sideways", "backward", "turn", "start_stop", "push")
PUSH = 10.0  # [N s] on the torso, within 0.1 s
PUSH_PERIOD = 2.0  # [s]
LONGEST_PULSE = 2.0  # [s] of walking, then as long of standing, in "start_stop"
PLENTY = 0.75  # share of a motor's limit that costs nothing


@dataclass(frozen=True)
class Figures:
    """What walks came to, each a mean over them.

    Attributes:
        survival: Share of the time that the robot was upright.
        speed: Speed realised in the commanded direction, by the commanded one; 1 is exact.
        torque: Greatest torque of any joint by its limit.
        joint_speed: Greatest speed of any joint by its limit.
        drift: Speed across the commanded direction and unwanted turning, by the commanded speed.
    """

    survival: float
    speed: float
    torque: float
    joint_speed: float
    drift: float

    @property
    def cost(self) -> float:
        """What the tuner makes small; see the module's text."""
        return (
            100.0 * (1.0 - self.survival)
            + 10.0 * min(max(1.0 - self.speed, 0.0), 1.0)
            + 4.0 * max(self.torque - PLENTY, 0.0)
            + 2.0 * max(self.joint_speed - PLENTY, 0.0)
            + 1.0 * min(self.drift, 1.0)
        )

    def as_dict(self) -> dict[str, float]:
        """Return the figures by name."""
        return asdict(self)


def check_names(names: Collection[str]) -> None:
    """Check names of parameters to tune.

    Raises:
        ValueError: if there is none, or one has no bounds.
    """
    unknown = sorted(set(names) - set(SPACE))
    if unknown:
        raise ValueError(f"{', '.join(unknown)} cannot be tuned; expected some of {', '.join(SPACE)}")
    if not names:
        raise ValueError(f"no parameter to tune; expected some of {', '.join(SPACE)}")


def evaluate(values: Mapping[str, float], seeds: Collection[int], seconds: float) -> Figures:
    """Judge a gait by all walks with all seeds.

    Args:
        values: Parameters that differ from their defaults.
        seeds: Of the worlds: masses, friction, sensor errors, directions of pushes.
        seconds: Length of each walk.

    Returns:
        The figures; those of a robot that never stands when the values are refused by MotionParameters.
    """
    try:
        parameters = replace(MotionParameters(), **dict(values))  # type: ignore[arg-type]  # all are numbers
    except ValueError:
        return Figures(0.0, 0.0, 2.0, 2.0, 1.0)
    figures = [try_walk(walk, parameters, seed, seconds) for walk in WALKS for seed in seeds]
    means = np.mean([list(each.as_dict().values()) for each in figures], axis=0)
    return Figures(*(float(value) for value in means))


def try_walk(walk: str, parameters: MotionParameters, seed: int, seconds: float) -> Figures:
    """Walk once.

    Args:
        walk: One of WALKS.
        parameters: Of motion control.
        seed: Of the world and of the pushes.
        seconds: How long.
    """
    p, rng = parameters, np.random.default_rng([seed, WALKS.index(walk)])
    forward, left, turn = {
        "forward": (p.max_speed_forward, 0.0, 0.0),
        "sideways": (0.0, p.max_speed_sideways * float(rng.choice((-1.0, 1.0))), 0.0),
        "backward": (-p.max_speed_backward, 0.0, 0.0),
        "turn": (0.0, 0.0, p.max_turn_rate * float(rng.choice((-1.0, 1.0)))),
        "start_stop": (0.7 * p.max_speed_forward, 0.0, 0.0),
        "push": (0.2, 0.0, 0.0),
    }[walk]
    go, stand = WalkCommand(0, WalkMode.WALK, (forward, left, turn)), WalkCommand(0, WalkMode.STAND)
    body = Body(seed, START, ball=(0.0, 0.0), parameters=p)
    body.go(0.3)
    efforts, speeds = body.world.robot.effort_limits, body.world.robot.velocity_limits
    ticks, fastest, upright, moved = round(seconds * 1000 / TICK), 0.0, 0, np.zeros(3)
    pulse, next_push = min(LONGEST_PULSE, seconds / 2.0), float(rng.uniform(0.3, 1.0)) * min(PUSH_PERIOD, seconds / 2)
    before = _planar(body)
    walking = 0.0
    for k in range(ticks):
        time = k * TICK / 1000.0
        standing = walk == "start_stop" and time % (2.0 * pulse) >= pulse
        if walk == "push" and time >= next_push:
            direction = rng.uniform(-math.pi, math.pi)
            body.world.push((10.0 * PUSH * math.cos(direction), 10.0 * PUSH * math.sin(direction), 0.0), 100)
            next_push += PUSH_PERIOD + float(rng.uniform(0.0, p.step_time))
        body.tick(stand if standing else go)
        now = _planar(body)
        step = now - before
        c, s = math.cos(before[2]), math.sin(before[2])
        moved += (c * step[0] + s * step[1], -s * step[0] + c * step[1], wrap_angle(step[2]))
        before = now
        walking += 0.0 if standing else TICK / 1000.0
        fastest = max(fastest, float((np.abs(body.world.truth().joint_velocities) / speeds).max()))
        if body.fallen:
            break
        upright += 1
    return _figures(upright / ticks, moved, (forward, left, turn), walking, body, fastest, efforts)


def _figures(
    survival: float,
    moved: np.ndarray,
    wanted: tuple[float, float, float],
    walking: float,
    body: Body,
    fastest: float,
    efforts: np.ndarray,
) -> Figures:
    scale = np.array([1.0, 1.0, 0.3])  # [m/rad] makes a turning rate a speed: about that of the feet
    asked = scale * np.array(wanted) * walking
    real = scale * moved
    length = float(np.linalg.norm(asked))
    along = float(real @ asked) / length
    across = float(np.linalg.norm(real - along * asked / length))
    torque = float((body.greatest_efforts / efforts).max())
    return Figures(survival, along / length, torque, fastest, across / length)


def _planar(body: Body) -> np.ndarray:
    truth = body.world.truth()
    x, y, z, w = truth.base_orientation.tolist()
    yaw = math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.array([truth.base_position[0], truth.base_position[1], yaw])
