"""Section 3.3 compared: gait, feedforward, weighting and learning in all combinations, walking straight ahead."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_motion.interface import WalkCommand, WalkMode
from tulip_motion.lipm import GRAVITY
from tulip_motion.parameters import CHOICES, MotionParameters
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.bench.tracking import Tracking
from tulip_sim.timing import TICK

SPEED = 0.2  # [m/s]
SEEDS = 3
DURATION = 30.0  # [s]
GAITS: dict[str, dict[str, Any]] = {
    "dcm": {"gait": "dcm"},
    "paper": {"gait": "paper"},
    "paper, smooth": {"gait": "paper", "paper_swing": "smooth"},
}
LEARNING_GAIT = "dcm"  # the other gaits do not learn over steps
FALLING = 1.0  # [s] before a fall is detected; errors of a falling robot say nothing of its control
START = Pose2D(-4.0, 2.2, 0.0)  # the way leads past the goal
NO_WEIGHTING = "-"  # without feedforward there is nothing to weigh


def combinations() -> list[tuple[str, str, str, str]]:
    """Return gait, feedforward, weighting and learning of each line of the table."""
    lines = []
    for gait, feedforward in product(GAITS, CHOICES["feedforward"]):
        weightings = (NO_WEIGHTING,) if feedforward == "none" else CHOICES["weight_sharing"]
        learnings = CHOICES["learning"] if gait == LEARNING_GAIT else ("none",)
        lines += [(gait, feedforward, *pair) for pair in product(weightings, learnings)]
    return lines


def parameters(gait: str, feedforward: str, weighting: str, learning: str) -> MotionParameters:
    """Return the parameters of one line."""
    changes = GAITS[gait] | {"feedforward": feedforward, "learning": learning}
    if weighting != NO_WEIGHTING:
        changes["weight_sharing"] = weighting
    return MotionParameters(**changes)


def measure(gait: str, feedforward: str, weighting: str, learning: str, seed: int) -> Row:
    """Walk once."""
    body = Body(seed, START, parameters=parameters(gait, feedforward, weighting, learning))
    body.go(0.3)
    command = WalkCommand(0, WalkMode.WALK, (SPEED, 0.0, 0.0))
    dt, ticks = TICK / 1000.0, round(DURATION * 1000 / TICK)
    tracking = Tracking()
    work, peak = 0.0, 0.0
    begin = body.world.truth().base_position[:2]
    while len(tracking) < ticks and not body.fallen:
        body.tick(command)
        tracking.add(body.motion.state())
        sensors = body.world.sensors()
        power = sensors.joint_efforts[:12] * sensors.joint_velocities[:12]
        work += dt * float(np.maximum(power, 0.0).sum())
        if not body.fallen:
            peak = max(peak, float(np.abs(sensors.joint_efforts[:12]).max()))
    way = float(np.linalg.norm(body.world.truth().base_position[:2] - begin))
    weight = GRAVITY * body.world.robot.mass
    upright = len(tracking) if not body.fallen else max(len(tracking) - round(FALLING / dt), 1)
    joint, com_error, zmp_error = tracking.rms(upright)
    return {
        "gait": gait,
        "feedforward": feedforward,
        "weighting": weighting,
        "learning": learning,
        "seed": seed,
        "upright": not body.fallen,
        "survived [s]": round(len(tracking) * dt, 1),
        "joint error RMS [mrad]": round(joint, 2),
        "CoM error RMS [mm]": round(com_error, 1),
        "ZMP error RMS [mm]": round(zmp_error, 1),
        "peak torque [N m]": round(peak, 1),
        "cost of transport": None if body.fallen else round(work / (weight * way), 3),
        "distance [m]": round(way, 2),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return a table, one line a combination."""
    lines = [
        f"Straight ahead at {SPEED} m/s for {DURATION:.0f} s without camera, randomised as for walking. Medians of the"
        f" seeds; errors are RMS until {FALLING:.0f} s before a fall: of the joints against q_d, of the estimated CoM"
        " against the planned one, of the measured centre of pressure against the commanded ZMP. Cost of transport is"
        " the positive work of the leg joints, sum of max(tau q', 0) dt, by m g d, of those that did not fall.",
        "",
        "| gait | feedforward | weighting | learning | upright | survived | joints | CoM | ZMP | peak torque"
        " | cost of transport |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    names = ("gait", "feedforward", "weighting", "learning")
    for line in dict.fromkeys(tuple(row[name] for name in names) for row in rows):
        own = [row for row in rows if tuple(row[name] for name in names) == line]
        costs = [row["cost of transport"] for row in own if row["cost of transport"] is not None]
        lines.append(
            f"| {' | '.join(line)} | {sum(row['upright'] for row in own)} of {len(own)}"
            f" | {_median(own, 'survived [s]'):.1f} s | {_median(own, 'joint error RMS [mrad]'):.1f} mrad"
            f" | {_median(own, 'CoM error RMS [mm]'):.0f} mm | {_median(own, 'ZMP error RMS [mm]'):.0f} mm"
            f" | {_median(own, 'peak torque [N m]'):.0f} N m | {f'{np.median(costs):.2f}' if costs else '-'} |"
        )
    return lines


def _median(rows: list[Row], name: str) -> float:
    values: NDArray[np.float64] = np.array([row[name] for row in rows])
    return float(np.median(values))


BENCH = Bench(
    "control",
    "Gaits and controllers",
    [(*line, seed) for line in combinations() for seed in range(SEEDS)],
    measure,
    summarize,
)
