"""Dead reckoning against the truth: how far it drifts, and whether its covariance says so."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray
from scipy.stats import chi2

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.interface import Odometry, WalkCommand, WalkMode
from tulip_sim.bench.body import Body
from tulip_sim.bench.random_walk import random_commands
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.timing import TICK
from tulip_sim.truth import Truth

Array = NDArray[np.float64]
SEEDS = 24
DURATION = 60.0  # [s]
PERIOD = 2.5  # [s] between two looks
START = Pose2D(0.0, 40.0, 0.0)  # off the field, where nothing is in the way
PLANE = (0, 1, 5)  # x, y and yaw among the six of a pose


def planar_error(odometry: Odometry, truth: Truth, start: Pose2D) -> Array:
    """Return (3,) truth - odometry of base_link: x, y [m] in odom, yaw [rad].

    Args:
        odometry: As motion control gives it.
        truth: Of about the same time; what the body moved between the two stamps is taken off.
        start: Where odom lies in map.
    """
    late = (truth.stamp - odometry.stamp) * 1e-9
    x, y = (truth.base_position[:2] - late * truth.base_linear_velocity[:2]).tolist()
    yaw = _yaw(truth.base_orientation) - late * float(truth.base_angular_velocity[2])
    really = start.inverse() @ Pose2D(x, y, yaw)
    believed = _yaw(odometry.orientation)
    dx, dy = really.x - float(odometry.position[0]), really.y - float(odometry.position[1])
    return np.array([dx, dy, wrap_angle(really.yaw - believed)])


def nees(error: Array, odometry: Odometry) -> float:
    """Return the normalized estimation error squared e^T P^-1 e of (x, y, yaw): 3 on average if P is right."""
    covariance = odometry.covariance[np.ix_(PLANE, PLANE)]
    return float(error @ np.linalg.solve(covariance, error))


def walk(seed: int, seconds: float, period: float) -> tuple[Body, list[tuple[Odometry, Array]]]:
    """Walk at random; return the body, and the odometry with its error at every period [s] while it was upright."""
    rng = np.random.default_rng([seed, 3])
    body = Body(seed, START, ball=(0.0, 0.0))
    looks: list[tuple[Odometry, Array]] = []
    tick, every = 0, round(period * 1000 / TICK)
    for duration, velocity in random_commands(rng, seconds):
        mode = WalkMode.STAND if velocity is None else WalkMode.WALK
        command = WalkCommand(0, mode, velocity or (0.0, 0.0, 0.0))
        for _ in range(round(duration * 1000 / TICK)):
            truth = body.world.truth()
            body.tick(command)
            tick += 1
            if body.fallen:
                return body, looks
            if tick % every == 0:
                odometry = body.motion.odometry()
                looks.append((odometry, planar_error(odometry, truth, START)))
    return body, looks


def bounds(runs: int) -> tuple[float, float]:
    """Return between which values the mean NEES of so many runs lies with 95 % if the covariance is right."""
    return float(chi2.ppf(0.025, df=3 * runs)) / runs, float(chi2.ppf(0.975, df=3 * runs)) / runs


def measure(seed: int) -> Row:
    """Walk once."""
    body, looks = walk(seed, DURATION, PERIOD)
    odometry = body.motion.odometry()
    error = planar_error(odometry, body.world.truth(), START)
    minutes = odometry.stamp / 60e9
    return {
        "seed": seed,
        "friction": round(body.world.friction, 3),
        "upright": not body.fallen,
        "distance [m]": round(odometry.distance, 2),
        "position error [m]": round(math.hypot(error[0], error[1]), 4),
        "drift [%]": round(100.0 * math.hypot(error[0], error[1]) / max(odometry.distance, 1.0), 3),
        "heading drift [deg/min]": round(math.degrees(error[2]) / minutes, 3),
        "errors x, y [m], yaw [rad]": [[round(float(value), 5) for value in each] for _, each in looks],
        "deviations x, y [m], yaw [rad]": [
            [round(float(value), 5) for value in np.sqrt(np.diag(each.covariance)[list(PLANE)])] for each, _ in looks
        ],
        "NEES": [round(nees(each, said), 3) for said, each in looks],
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return drift and consistency."""
    whole = [row for row in rows if row["upright"]]
    drift = np.abs([row["drift [%]"] for row in rows])
    heading = np.array([row["heading drift [deg/min]"] for row in rows])
    lines = [
        f"{DURATION:.0f} s of random commands (forward, backward, sideways, turning, arcs, standing), randomised as for"
        " walking; odometry of legs and IMU alone against the truth.",
        "",
        f"- upright: {len(whole)} of {len(rows)}",
        f"- drift in position at the end: median {np.median(drift):.2f} %, most {drift.max():.2f} % of the way walked"
        f" (median {np.median([row['distance [m]'] for row in rows]):.1f} m)",
        f"- heading drift: {np.sqrt((heading**2).mean()):.2f} deg/min RMS, most {np.abs(heading).max():.2f} deg/min",
    ]
    if whole:
        low, high = bounds(len(whole))
        means = np.mean([row["NEES"] for row in whole], axis=0)
        inside = int(np.sum((means >= low) & (means <= high)))
        lines.append(
            f"- NEES of (x, y, yaw), mean over runs and times: {means.mean():.2f} (3 if the covariance is exact);"
            f" means at {inside} of {len(means)} times inside the 95 % bounds {low:.2f} to {high:.2f},"
            f" {int(np.sum(means > high))} above (too sure of itself), {int(np.sum(means < low))} below (too careful)"
        )
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw errors beside their claimed 2-sigma bounds, and the mean NEES beside the bounds of chi-square."""
    whole = [row for row in rows if row["upright"]]
    if not whole:
        return
    figure = Figure(figsize=(9, 6.5), layout="constrained")
    axes = figure.subplots(2, 2)
    names = (("x", 1000.0, "mm"), ("y", 1000.0, "mm"), ("yaw", math.degrees(1.0), "deg"))
    errors = np.array([row["errors x, y [m], yaw [rad]"] for row in whole])
    deviations = np.array([row["deviations x, y [m], yaw [rad]"] for row in whole])
    times = PERIOD * np.arange(1, errors.shape[1] + 1)
    for index, (name, scale, unit) in enumerate(names):
        axis = axes.flat[index]
        axis.plot(times, scale * errors[:, :, index].T, color="tab:blue", linewidth=0.6, alpha=0.6)
        bound = 2.0 * scale * np.sqrt((deviations[:, :, index] ** 2).mean(axis=0))
        axis.fill_between(times, -bound, bound, color="tab:orange", alpha=0.25, label="2 sigma as claimed, RMS of runs")
        axis.set(title=f"error of {name}", xlabel="time [s]", ylabel=f"[{unit}]")
        axis.legend(loc="upper left", fontsize="small")
    low, high = bounds(len(whole))
    axis = axes.flat[3]
    axis.plot(times, np.mean([row["NEES"] for row in whole], axis=0), marker=".", label=f"mean of {len(whole)} runs")
    axis.axhspan(low, high, color="tab:green", alpha=0.2, label="95 % bounds")
    axis.axhline(3.0, color="black", linewidth=0.5)
    axis.set(title="NEES of (x, y, yaw)", xlabel="time [s]", ylim=(0.0, None))
    axis.legend(loc="upper left", fontsize="small")
    figure.savefig(path, dpi=110)


def _yaw(orientation: Array) -> float:
    x, y, z, w = orientation.tolist()
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


BENCH = Bench("odometry", "Odometry", [(seed,) for seed in range(SEEDS)], measure, summarize, draw)
