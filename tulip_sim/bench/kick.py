"""Kicking a resting ball: forward and sideways from standing, and by a step of a walk that goes on."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tulip_description.planar import Pose2D, wrap_angle
from tulip_motion.interface import KickGoal, KickKind, MotionMode, Side
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.parameters import WorldParameters
from tulip_strategy.parameters import StrategyParameters

PLACE_ERROR = 0.015  # [m] standard deviation of the ball's place, as strategy leaves it
SIGHT_ERROR = 0.010  # [m] standard deviation of the place that the kick is told
DIRECTIONS = (0.0, 0.2, -0.2)  # [rad] wanted; sideways about straight to the left or right
OUTWARD_ROOM = 0.125  # [m/rad] farther out lies a ball that is to go outwards, for the run-up beside the other foot
WANTED = {KickKind.FORWARD: 3.2, KickKind.SIDE: 1.7, KickKind.WALKING: 1.5}  # [m/s]
LEAST = {KickKind.FORWARD: 3.0, KickKind.SIDE: 1.5, KickKind.WALKING: 1.0}  # [m/s] that count as good
WALK_SPEED = 0.25  # [m/s] as in dribbling
WALK_ON = 5.0  # [s] after the start of a walking kick the robot has to walk still
TRIALS = 20  # of each kind


def measure(
    kind: KickKind, side: Side, seed: int, direction: float, told: bool, world: WorldParameters | None = None
) -> Row:
    """Kick once.

    Args:
        kind: See `KickKind`.
        side: Which foot.
        seed: Of everything random.
        direction: Wanted [rad]: against straight ahead, or for a side kick straight to its side.
        told: Whether the kick is told where the ball lies.
        world: Physics and sensors.
    """
    rng = np.random.default_rng([seed, side, kind])
    outward = 1.0 if side is Side.LEFT else -1.0
    body = Body(10 * seed + side, Pose2D(-2.0, 0.0, 0.0), (0.0, -2.5), world=world)
    body.go(0.5)
    walk = (WALK_SPEED, 0.0, 0.0) if kind is KickKind.WALKING else None
    if walk is not None:
        body.go(2.5 + float(rng.uniform(0.0, 0.9)), walk)  # any phase of the two steps
    else:
        body.go(1.5, (0.0, 0.0, 0.0))  # the feet as a walk leaves them
        body.go(2.5)
    base = body.world.truth().footprint
    place = _place(kind, side, direction, body, rng)
    body.world.place_ball(*base.transform(place))
    seen = place + rng.normal(0.0, SIGHT_ERROR, 2)
    wanted = direction + (outward * 0.5 * math.pi if kind is KickKind.SIDE else 0.0)
    ball = (float(seen[0]), float(seen[1])) if told else None
    body.greatest_tilt = body.ball_speed = 0.0
    body.greatest_efforts[:] = 0.0
    refusal = body.motion.start_kick(KickGoal(side, wanted, WANTED[kind], kind, ball))
    joint_speed = 0.0
    for _ in range(round(WALK_ON / 0.004)):
        body.go(0.004, walk)
        joint_speed = max(joint_speed, float(np.abs(body.world.truth().joint_velocities).max()))
    progress = body.motion.kick_progress
    error = wrap_angle(body.ball_direction - base.yaw - wanted)
    return {
        "kind": kind.name.lower(),
        "foot": side.name.lower(),
        "seed": seed,
        "told": told,
        "wanted direction [rad]": round(wanted, 3),
        "wanted speed [m/s]": WANTED[kind],
        "refusal": refusal or (progress.reason if progress is not None else ""),
        "upright": body.motion.mode is (MotionMode.WALK if walk is not None else MotionMode.STAND),
        "ball speed [m/s]": round(body.ball_speed, 2),
        "direction error [deg]": round(math.degrees(error), 1),
        "greatest joint speed [rad/s]": round(joint_speed, 1),
        "greatest torque by limit": round(float((body.greatest_efforts / body.world.robot.effort_limits).max()), 2),
        "greatest tilt [rad]": round(body.greatest_tilt, 3),
    }


def _place(kind: KickKind, side: Side, direction: float, body: Body, rng: np.random.Generator) -> np.ndarray:
    """Return where the ball lies, (2,) in base_footprint [m]."""
    strategy = StrategyParameters()
    if kind is KickKind.SIDE:
        place = body.motion.expected_ball(kind, side)
    else:
        ahead = strategy.kick_ahead if kind is KickKind.FORWARD else float(rng.uniform(0.55, 0.85))
        outward = 1.0 if side is Side.LEFT else -1.0
        beside = strategy.kick_lateral + OUTWARD_ROOM * max(0.0, outward * direction)
        place = ahead, outward * beside
    return np.array(place) + rng.normal(0.0, PLACE_ERROR, 2)


def summarize(rows: list[Row]) -> list[str]:
    """Return a table, one line a kind."""
    lines = [
        f"A resting ball, its place random by +-{1000 * PLACE_ERROR:.0f} mm and told to the kick with +-"
        f"{1000 * SIGHT_ERROR:.0f} mm, or not told; wanted directions 0 and +-0.2 rad (not told: 0). A ball to be"
        f" kicked outwards lies 25 mm farther out. The walking kick comes in a walk at {WALK_SPEED} m/s that goes on."
        " Randomised as for walking. A good kick is carried out, leaves the robot upright and the ball fast enough.",
        "",
        "| kick | wanted | good | upright | ball speed: least, median | direction error: RMS, mean"
        " | joint speed, most | torque by its limit, most | tilt, most |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for kind in KickKind:
        for told in (True, False):
            own = [row for row in rows if row["kind"] == kind.name.lower() and row["told"] is told]
            if own:
                lines.append(_line(kind, told, own))
    refusals = [f"- {row['kind']}, {row['foot']} foot, seed {row['seed']}: {row['refusal']}" for row in rows]
    refused = [line for line, row in zip(refusals, rows, strict=True) if row["refusal"]]
    return [*lines, "", "Not carried out:", "", *refused] if refused else lines


def _line(kind: KickKind, told: bool, rows: list[Row]) -> str:
    kicked = [row for row in rows if not row["refusal"]]
    good = [row for row in kicked if row["upright"] and row["ball speed [m/s]"] >= LEAST[kind]]
    upright = sum(row["upright"] for row in rows)
    speeds = [row["ball speed [m/s]"] for row in kicked] or [math.nan]
    errors = np.array([row["direction error [deg]"] for row in kicked] or [math.nan])
    most = {
        name: max(row[name] for row in rows)
        for name in ("greatest joint speed [rad/s]", "greatest torque by limit", "greatest tilt [rad]")
    }
    return (
        f"| {kind.name.lower()}{'' if told else ', place not told'} | {rows[0]['wanted speed [m/s]']} m/s"
        f" | {len(good)} of {len(rows)} at {LEAST[kind]} m/s or more | {upright} of {len(rows)}"
        f" | {min(speeds):.2f}, {np.median(speeds):.2f} m/s"
        f" | {np.sqrt((errors**2).mean()):.1f}, {errors.mean():.1f} deg"
        f" | {most['greatest joint speed [rad/s]']:.1f} rad/s | {most['greatest torque by limit']:.2f}"
        f" | {most['greatest tilt [rad]']:.2f} rad |"
    )


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw where the balls went, by kind: velocity of the ball in the robot's axes, forward up."""
    figure = Figure(figsize=(12.0, 4.4), layout="constrained")
    for kind, axes in zip(KickKind, figure.subplots(1, len(KickKind)), strict=True):
        axes.set_title(f"{kind.name.lower()} kick")
        own = [row for row in rows if row["kind"] == kind.name.lower() and not row["refusal"]]
        for wanted in sorted({row["wanted direction [rad]"] for row in own}):
            line = axes.plot(
                [0.0, -4.0 * math.sin(wanted)], [0.0, 4.0 * math.cos(wanted)], linestyle="--", linewidth=0.8
            )
            for row in own:
                if row["wanted direction [rad]"] == wanted:
                    angle, speed = wanted + math.radians(row["direction error [deg]"]), row["ball speed [m/s]"]
                    axes.plot(
                        [0.0, -speed * math.sin(angle)],
                        [0.0, speed * math.cos(angle)],
                        color=line[0].get_color(),
                        linewidth=0.8,
                        marker="o" if row["foot"] == "left" else "s",
                        markevery=[1],
                        markersize=4.0,
                    )
        reach = 1.15 * max((row["ball speed [m/s]"] for row in own), default=1.0)
        across, low, high = (1.0, -0.5, 0.5) if kind is KickKind.SIDE else (0.5, -0.05, 1.0)
        axes.set(xlim=(-across * reach, across * reach), ylim=(low * reach, high * reach), aspect="equal")
        axes.set(xlabel="right [m/s]", ylabel="forward [m/s]")
    figure.suptitle("Ball's velocity after the kick; dashed: wanted direction; circles: left foot, squares: right foot")
    figure.savefig(path, dpi=110)


def _trials() -> list[tuple[KickKind, Side, int, float, bool]]:
    trials = [
        (kind, Side(index % 2), index, DIRECTIONS[index % len(DIRECTIONS)], True)
        for kind in KickKind
        for index in range(TRIALS)
    ]
    return trials + [(KickKind.FORWARD, Side(index % 2), index, 0.0, False) for index in range(TRIALS // 2)]


BENCH = Bench("kick", "Kicking", _trials(), measure, summarize, draw)
