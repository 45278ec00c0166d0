"""What the gait tuner looks for: which parameters, within which bounds, and what makes a gait good.

A candidate is judged by randomised walks of every kind and by single pushes as in bench `push`; the same seeds for
all candidates, so that they differ in the gait alone. The forward walk is the fastest, on the most slippery carpet.
`Figures` are means; `cost` weighs them such that each line of this list matters only among gaits that are about equal
in the lines above it:

1. survival: share of the time asked for that the robot stayed upright in walks (weight 100)
2. pushes: share of the pushes survived; one that was not counts by the time that the robot stayed upright, at most
   half, so that a fall that was nearly caught is better than one that was not (40: one push of 16 is worth 2.5)
3. speed: what lacks of the commanded speed, as a share of it (10)
4. torque: greatest torque by its limit; only what is above three quarters of it (4)
5. joint speed: greatest joint speed by its limit; only what is above three quarters (2)
6. drift: speed across the commanded direction, and turning that was not asked for, by the commanded speed (1)
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.robot import load_robot
from tulip_motion.interface import WalkCommand, WalkMode
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import reach
from tulip_sim.bench.body import Body
from tulip_sim.bench.push import AFTER, DIRECTIONS, PHASES, time_upright
from tulip_sim.parameters import WorldParameters
from tulip_sim.timing import TICK

START = Pose2D(0.0, 40.0, 0.0)  # off the field, where nothing is in the way

SPACE: dict[str, tuple[float, float]] = {
    "com_height": (0.66, 0.735),  # [m] from deep knees to almost straight ones
    "step_time": (0.30, 0.60),  # [s]
    "step_time_growth": (0.0, 0.4),  # [s/(m/s)]
    "double_support_time": (0.03, 0.12),  # [s]
    "first_shift_time": (0.3, 0.8),  # [s]
    "stop_shift_time": (0.3, 0.9),  # [s]
    "stance_width": (0.20, 0.285),  # [m] from soles 50 mm apart; wider, legs reach less far sideways and to a ball
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
    "zmp_limit_side": (0.045, 0.074),  # [m] half a sole is 0.075 m
    "observer_position_gain": (10.0, 80.0),  # [1/s]
    "observer_velocity_gain": (20.0, 160.0),  # [1/s]
    "height_stiffness": (40.0, 250.0),  # [1/s^2]
    "height_damping": (8.0, 40.0),  # [1/s]
    "torso_stiffness": (20.0, 200.0),  # [1/s^2]
    "torso_damping": (5.0, 30.0),  # [1/s]
    "cmp_beyond_sole": (0.0, 0.1),  # [m]
    "max_lean": (0.0, 0.5),  # [rad]
}
"""Bounds of every parameter in gait.yaml."""

LEAST_SPEEDS = {"forward": 0.62, "backward": 0.31, "sideways": 0.257, "turning": 1.25}
"""What the legs' reach has to allow a gait [m/s], [rad/s]: a little more than benches ask for."""

WALKS = ("forward", "sideways", "backward", "turn", "start_stop")
SLIPPERY = WorldParameters(friction=(WorldParameters.friction[0],) * 2)
PUSH = (11.5, 13.0)  # [N s] range
WEAK_PUSHES: tuple[tuple[int, float | None], ...] = (
    *((45, 0.05), (90, 0.05), (90, 0.2), (180, None), (270, 0.8), (0, 0.8)),
    *((45, 0.2), (135, 0.05), (225, 0.8), (135, None), (315, 0.8), (180, 0.4)),
)
"""Direction [deg] and phase, None while standing, of pushes that gaits survived least."""
# 8 directions and 6 phases meet in pairs of like parity only; the second half of the round is moved by one.
_PUSHES = ((DIRECTIONS[(3 * i + i // 24) % len(DIRECTIONS)], PHASES[i % len(PHASES)]) for i in range(48))
OTHER_PUSHES = tuple(push for push in _PUSHES if push not in WEAK_PUSHES)
"""The other pushes of bench `push`."""
WEAK_SHARE, OTHER_SHARE = 6, 2  # pushes a seed of each kind; the next seed has the next ones
FALL_SHARE = 0.5  # of a push survived, at most, for one that was not
LONGEST_PULSE = 2.0  # [s] of walking, then as long of standing, in "start_stop"
PLENTY = 0.75  # share of a motor's limit that costs nothing


@dataclass(frozen=True)
class Figures:
    """What walks and pushes came to, each a mean over them.

    Attributes:
        survival: Share of the time that the robot was upright in walks.
        pushes: Share of the pushes survived; see the module's text.
        speed: Speed realised in the commanded direction, by the commanded one; 1 is exact.
        torque: Greatest torque of any joint by its limit.
        joint_speed: Greatest speed of any joint by its limit.
        drift: Speed across the commanded direction and unwanted turning, by the commanded speed.
    """

    survival: float
    pushes: float
    speed: float
    torque: float
    joint_speed: float
    drift: float

    @property
    def cost(self) -> float:
        """What the tuner makes small; see the module's text."""
        return (
            100.0 * (1.0 - self.survival)
            + 40.0 * (1.0 - self.pushes)
            + 10.0 * min(max(1.0 - self.speed, 0.0), 1.0)
            + 4.0 * max(self.torque - PLENTY, 0.0)
            + 2.0 * max(self.joint_speed - PLENTY, 0.0)
            + 1.0 * min(self.drift, 1.0)
        )

    def as_dict(self) -> dict[str, float]:
        """Return the figures by name."""
        return asdict(self)


REFUSED = Figures(0.0, 0.0, 0.0, 2.0, 2.0, 1.0)
"""What a gait comes to that is not tried."""


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
    """Judge a gait by all walks and pushes with all seeds.

    Args:
        values: Parameters that differ from their defaults.
        seeds: Of the worlds: masses, friction, sensor errors; and of the choice of pushes.
        seconds: Length of each walk.

    Returns:
        The figures; those of a robot that never stands when the values are refused by MotionParameters, or too slow.
    """
    try:
        parameters = replace(MotionParameters(), **dict(values))  # type: ignore[arg-type]  # all are numbers
        limits = reach(parameters, load_robot())
    except ValueError:
        return REFUSED
    if any(getattr(limits, name) < least for name, least in LEAST_SPEEDS.items()):
        return REFUSED
    walks = [try_walk(walk, parameters, seed, seconds) for walk in WALKS for seed in seeds]
    pushes = [share for seed in seeds for share in try_pushes(parameters, seed)]
    means = {name: float(np.mean([walk[name] for walk in walks])) for name in walks[0]}
    return Figures(pushes=float(np.mean(pushes)), **means)


def pushes_of(seed: int) -> list[tuple[int, float | None, float]]:
    """Return direction [deg], phase (None: standing) and impulse [N s] of the pushes of a seed.

    Two seeds have all the weak pushes of the list, and each has others besides.
    """
    rng = np.random.default_rng([seed, len(WALKS)])
    weak = [WEAK_PUSHES[(WEAK_SHARE * seed + i) % len(WEAK_PUSHES)] for i in range(WEAK_SHARE)]
    others = [OTHER_PUSHES[(OTHER_SHARE * seed + i) % len(OTHER_PUSHES)] for i in range(OTHER_SHARE)]
    return [(direction, phase, float(rng.uniform(*PUSH))) for direction, phase in weak + others]


def try_pushes(parameters: MotionParameters, seed: int) -> list[float]:
    """Push a robot, each time from a fresh start.

    Args:
        parameters: Of motion control.
        seed: Of the world and of the choice of pushes.

    Returns:
        For each push 1 if it was survived, else less, by the time that the robot stayed upright.
    """
    times = [time_upright(direction, phase, impulse, seed, parameters) for direction, phase, impulse in pushes_of(seed)]
    return [1.0 if time >= AFTER else FALL_SHARE * time / AFTER for time in times]


def try_walk(walk: str, parameters: MotionParameters, seed: int, seconds: float) -> dict[str, float]:
    """Walk once and return the figures by name, without pushes.

    Args:
        walk: One of WALKS.
        parameters: Of motion control.
        seed: Of the world.
        seconds: How long.
    """
    p, rng = parameters, np.random.default_rng([seed, WALKS.index(walk)])
    forward, left, turn = {
        "forward": (p.max_speed_forward, 0.0, 0.0),
        "sideways": (0.0, p.max_speed_sideways * float(rng.choice((-1.0, 1.0))), 0.0),
        "backward": (-p.max_speed_backward, 0.0, 0.0),
        "turn": (0.0, 0.0, p.max_turn_rate * float(rng.choice((-1.0, 1.0)))),
        "start_stop": (0.7 * p.max_speed_forward, 0.0, 0.0),
    }[walk]
    go, stand = WalkCommand(0, WalkMode.WALK, (forward, left, turn)), WalkCommand(0, WalkMode.STAND)
    world = SLIPPERY if walk == "forward" else WorldParameters()
    body = Body(seed, START, ball=(0.0, 0.0), parameters=p, world=world)
    body.go(0.3)
    efforts, speeds = body.world.robot.effort_limits, body.world.robot.velocity_limits
    ticks, fastest, upright, moved = round(seconds * 1000 / TICK), 0.0, 0, np.zeros(3)
    pulse = min(LONGEST_PULSE, seconds / 2.0)
    before = body.world.truth().footprint.as_array()
    walking = 0.0
    for k in range(ticks):
        standing = walk == "start_stop" and k * TICK / 1000.0 % (2.0 * pulse) >= pulse
        body.tick(stand if standing else go)
        now = body.world.truth().footprint.as_array()
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
) -> dict[str, float]:
    """Return the figures by name, from the way in the robot's own axes and what was asked for while walking."""
    scale = np.array([1.0, 1.0, 0.3])  # [m/rad] makes a turning rate a speed: about that of the feet
    asked = scale * np.array(wanted) * walking
    real = scale * moved
    length = float(np.linalg.norm(asked))
    along = float(real @ asked) / length
    across = float(np.linalg.norm(real - along * asked / length))
    torque = float((body.greatest_efforts / efforts).max())
    return {
        "survival": survival,
        "speed": along / length,
        "torque": torque,
        "joint_speed": fastest,
        "drift": across / length,
    }
