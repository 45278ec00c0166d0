"""Walking straight ahead: does the robot stay upright, how far does it come."""

from __future__ import annotations

import numpy as np

from tulip_description.planar import Pose2D
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row

SPEEDS = (0.4, 0.6)  # [m/s]
SEEDS = 10
DURATION = 60.0  # [s]
START = Pose2D(-4.0, 2.2, 0.0)  # the way leads past the goal


def measure(speed: float, seed: int) -> Row:
    """Walk once."""
    body = Body(seed, START)
    body.go(0.3)
    body.go(DURATION, (speed, 0.0, 0.0))
    end = body.world.truth().base_position
    limits = body.world.robot.effort_limits
    return {
        "speed commanded [m/s]": speed,
        "seed": seed,
        "friction": round(body.world.friction, 3),
        "upright": not body.fallen,
        "distance [m]": round(float(np.hypot(end[0] - START.x, end[1] - START.y)), 2),
        "sideways [m]": round(float(end[1] - START.y), 2),
        "greatest tilt [rad]": round(body.greatest_tilt, 3),
        "greatest torque by limit": round(float((body.greatest_efforts / limits).max()), 2),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return a table, one line a speed."""
    lines = [
        f"Straight ahead for {DURATION:.0f} s without camera. Friction 0.6-1.0, link masses +-5 %, joint friction,"
        " sensor noise and delay are random; torques act one tick after their sensors.",
        "",
        "| commanded | upright | distance, median | sideways, most | tilt, most | torque by its limit, most |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for speed in sorted({row["speed commanded [m/s]"] for row in rows}):
        own = [row for row in rows if row["speed commanded [m/s]"] == speed]
        lines.append(
            f"| {speed} m/s | {sum(row['upright'] for row in own)} of {len(own)}"
            f" | {np.median([row['distance [m]'] for row in own]):.1f} m of {speed * DURATION:.0f} m"
            f" | {max(abs(row['sideways [m]']) for row in own):.1f} m"
            f" | {max(row['greatest tilt [rad]'] for row in own):.2f} rad"
            f" | {max(row['greatest torque by limit'] for row in own):.2f} |"
        )
    return lines


BENCH = Bench("walk", "Walking", [(speed, seed) for speed in SPEEDS for seed in range(SEEDS)], measure, summarize)
