"""The same robot, motion control and seeds on each physics engine: nothing may be tuned to one of them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from tulip_description.planar import Pose2D
from tulip_motion.interface import KickKind, Side, WalkCommand, WalkMode
from tulip_motion.reach import Velocity
from tulip_sim.bench import kick
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.bench.tracking import Tracking
from tulip_sim.bench.walk import legs
from tulip_sim.lockstep import Settings
from tulip_sim.match_lockstep import play_lockstep
from tulip_sim.parameters import ENGINES, WorldParameters
from tulip_sim.referee import Result
from tulip_sim.timing import TICK

START = Pose2D(-30.0, 10.0, 0.0)  # far from goals and ball
SEEDS = 10
FALLING = 250  # ticks before a fall is detected whose errors say nothing of the control
RANDOM = "random commands"
KICK = "kick forward"
TRIAL = "trial"

# velocity, duration [s]; None is to stand
TASKS: dict[str, tuple[Velocity | None, float]] = {
    "stand": (None, 20.0),
    "forward 0.3 m/s": ((0.3, 0.0, 0.0), 60.0),
    "forward 0.6 m/s": ((0.61, 0.0, 0.0), 30.0),
    RANDOM: (None, 30.0),
}


def commands(task: str, seed: int) -> Iterator[WalkCommand]:
    """Yield the command of each tick."""
    parts = legs(RANDOM, seed) if task == RANDOM else [(TASKS[task][1], TASKS[task][0])]
    for duration, velocity in parts:
        mode = WalkMode.STAND if velocity is None else WalkMode.WALK
        for _ in range(round(duration * 1000 / TICK)):
            yield WalkCommand(0, mode, velocity or (0.0, 0.0, 0.0))


def measure(task: str, engine: str, seed: int) -> Row:
    """Stand, walk, kick or play a trial once."""
    if task == KICK:
        return _kick(engine, seed)
    if task == TRIAL:
        return _trial(engine, seed)
    body = Body(seed, START, world=WorldParameters(engine=engine))
    body.go(0.3)
    tracking, begin = Tracking(), body.world.truth().base_position
    for command in commands(task, seed):
        body.tick(command)
        if body.fallen:
            break
        tracking.add(body.motion.state())
    ticks = max(len(tracking) - FALLING, 1) if body.fallen else len(tracking)
    joint, com, zmp = tracking.rms(ticks)
    way = float(np.linalg.norm((body.world.truth().base_position - begin)[:2]))
    return {
        "task": task,
        "engine": engine,
        "seed": seed,
        "friction": round(body.world.friction, 3),
        "upright": not body.fallen,
        "time [s]": round(len(tracking) * TICK / 1000, 1),
        "joint error RMS [mrad]": round(joint, 2),
        "CoM error RMS [mm]": round(com, 1),
        "ZMP error RMS [mm]": round(zmp, 1),
        "greatest tilt [rad]": round(body.greatest_tilt, 3),
        "greatest torque by limit": round(float((body.greatest_efforts / body.world.robot.effort_limits).max()), 2),
        "way [m]": round(way, 2),
    }


def _kick(engine: str, seed: int) -> Row:
    kicked = kick.measure(KickKind.FORWARD, Side(seed % 2), seed, 0.0, True, WorldParameters(engine=engine))
    names = ("upright", "ball speed [m/s]", "direction error [deg]", "greatest torque by limit", "greatest tilt [rad]")
    return {"task": KICK, "engine": engine, "seed": seed} | {name: kicked[name] for name in names}


def _trial(engine: str, seed: int) -> Row:
    summary = play_lockstep(seed, settings=Settings(world=WorldParameters(engine=engine)))
    return {
        "task": TRIAL,
        "engine": engine,
        "seed": seed,
        "outcome": summary.outcome,
        "time [s]": round(summary.time, 1),
        "touches": summary.touches,
        "falls": summary.falls,
        "localization error [m]": round(summary.localization_error, 3),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return a table, one line a task and engine."""
    seeds = len({row["seed"] for row in rows})
    lines = [
        "Motion control alone, unchanged, with the same random robots (masses, friction, sensors) on each engine:"
        f" {seeds} seeds a line. Medians; errors are RMS until a second before a fall: of the joints against q_d, of"
        " the estimated CoM against the planned one, of the measured centre of pressure against the commanded ZMP."
        " What differs between the engines is the physics of contacts and of a step: [engines.md](engines.md).",
        "",
        "| task | engine | upright | joints | CoM | ZMP | tilt, most | torque by limit, most | way: least, median |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for task, (_, duration) in TASKS.items():
        for engine in ENGINES:
            own = [row for row in rows if (row["task"], row["engine"]) == (task, engine)]
            if not own:
                continue
            joint, com, zmp = (
                np.median([row[f"{name} error RMS [{unit}]"] for row in own])
                for name, unit in (("joint", "mrad"), ("CoM", "mm"), ("ZMP", "mm"))
            )
            ways = [row["way [m]"] for row in own]
            lines.append(
                f"| {task}, {duration:.0f} s | {engine} | {sum(row['upright'] for row in own)} of {len(own)}"
                f" | {joint:.2f} mrad | {com:.1f} mm | {zmp:.1f} mm"
                f" | {max(row['greatest tilt [rad]'] for row in own):.3f} rad"
                f" | {max(row['greatest torque by limit'] for row in own):.2f}"
                f" | {min(ways):.2f} m, {np.median(ways):.2f} m |"
            )
    for task, summarize_task in ((KICK, _summarize_kicks), (TRIAL, _summarize_trials)):
        own = [row for row in rows if row["task"] == task]
        lines += summarize_task(own) if own else []
    return lines


def _summarize_kicks(rows: list[Row]) -> list[str]:
    lines = [
        "",
        f"The same for the forward kick from standing, {kick.WANTED[KickKind.FORWARD]} m/s wanted.",
        "",
        "| engine | upright | ball speed: least, median, most | direction error: median, most |",
        "| --- | --- | --- | --- |",
    ]
    for engine in ENGINES:
        own = [row for row in rows if row["engine"] == engine]
        if own:
            speeds = [row["ball speed [m/s]"] for row in own]
            errors = [abs(row["direction error [deg]"]) for row in own]
            lines.append(
                f"| {engine} | {sum(row['upright'] for row in own)} of {len(own)}"
                f" | {min(speeds):.2f}, {np.median(speeds):.2f}, {max(speeds):.2f} m/s"
                f" | {np.median(errors):.1f}, {max(errors):.1f} deg |"
            )
    return lines


def _summarize_trials(rows: list[Row]) -> list[str]:
    lines = [
        "",
        "Trials with camera and vision, in lockstep, the whole stack unchanged.",
        "",
        "| engine | goals | falls | time to goal: median, most | touches, median | localization, median |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for engine in ENGINES:
        own = [row for row in rows if row["engine"] == engine]
        goals = [row for row in own if row["outcome"] == Result.GOAL.value]
        if own:
            times = [row["time [s]"] for row in goals] or [np.nan]
            lines.append(
                f"| {engine} | {len(goals)} of {len(own)} | {sum(row['falls'] for row in own)}"
                f" | {np.median(times):.1f}, {max(times):.1f} s | {np.median([row['touches'] for row in own]):.0f}"
                f" | {np.median([row['localization error [m]'] for row in own]):.3f} m |"
            )
    return lines


BENCH = Bench(
    "engines",
    "Physics engines",
    [(task, engine, seed) for task in (*TASKS, KICK, TRIAL) for seed in range(SEEDS) for engine in ENGINES],
    measure,
    summarize,
)
