"""Time and tracking error of inverse kinematics beside Pink and PlaCo, and where the control tick's time goes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from tulip_description.planar import Pose2D
from tulip_motion import tracking
from tulip_motion.inverse_kinematics import InverseKinematics
from tulip_motion.motion import Motion
from tulip_motion.state_estimator import StateEstimator
from tulip_motion.tracking import Tracking
from tulip_sim.bench import clik_solvers
from tulip_sim.bench.body import Body
from tulip_sim.bench.clik_reference import replaced, tracking_errors, walk_reference
from tulip_sim.bench.runner import Bench, Row

ROUNDS = 5  # of all solvers in turn, so that what slows the machine for a while slows all of them
TICK_SEEDS = range(3)
WALK = (((0.5, 0.0, 0.0), 8.0), ((0.1, 0.15, 0.3), 6.0), ((-0.2, 0.0, 0.0), 4.0), (None, 2.0))  # velocity, seconds
BARS = (200.0, 500.0)  # [us] median and 99th percentile of a tick

PARTS: dict[str, tuple[tuple[Any, str], ...]] = {
    "state estimator": ((StateEstimator, "update"),),
    "gait": ((Motion, "_advance_gait"),),
    "ground track": ((Motion, "_follow"),),
    "balance": ((Motion, "_stabilize"), (tracking, "turn_for_balance")),
    "inverse kinematics (10)": tuple(
        (InverseKinematics, name) for name in ("update_jacobian", "solve_velocity", "integrate")
    ),
    "joint accelerations": ((InverseKinematics, "solve_acceleration"),),
    "feedforward (14)-(15)": ((tracking, "inverse_dynamics"), (tracking, "feedforward"), (Tracking, "_sharing")),
}
"""Functions whose time makes up each part of a tick; what is left is the rest."""


def measure(what: str, which: str | int) -> Row:
    """Run one trial: ("solver", name), ("tick", seed) or ("parts", seed)."""
    if what == "solver":
        return measure_solver(str(which))
    return measure_tick(int(which)) if what == "tick" else measure_parts(int(which))


def measure_solver(name: str) -> Row:
    """Let one solver follow the recorded walk once."""
    reference = walk_reference()
    replay = clik_solvers.SOLVERS[name](reference)
    times = 1e6 * replay.seconds
    return {
        "solver": name,
        "median [us]": round(float(np.median(times)), 2),
        "p99 [us]": round(float(np.percentile(times, 99)), 2),
        "solves": len(times),
        **tracking_errors(reference, replay.postures),
        "remark": replay.remark,
    }


def walk(seed: int) -> Body:
    """Walk in the simulation."""
    body = Body(seed, Pose2D(-4.0, 2.2))
    body.go(0.5)
    for velocity, seconds in WALK:
        body.go(seconds, velocity)
    return body


def stopwatch(spans: list[float], clock: Callable[[], float]) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return what makes of a function one that notes how long each call took [s]."""

    def make(original: Callable[..., Any]) -> Callable[..., Any]:
        def timed(*given: Any) -> Any:
            begun = clock()
            answer = original(*given)
            spans.append(clock() - begun)
            return answer

        return timed

    return make


def measure_tick(seed: int) -> Row:
    """Time whole ticks while walking, by the clock and by the processor time that they took."""
    spans: list[float] = []
    busy: list[float] = []
    with (
        replaced(Motion, "tick", stopwatch(busy, time.thread_time)),
        replaced(Motion, "tick", stopwatch(spans, time.perf_counter)),
    ):
        body = walk(seed)
    whole, own = 1e6 * np.array(spans), 1e6 * np.array(busy)
    return {
        "tick": "whole",
        "seed": seed,
        "upright": not body.fallen,
        "ticks": len(whole),
        "median [us]": round(float(np.median(whole)), 1),
        "p99 [us]": round(float(np.percentile(whole, 99)), 1),
        "median of processor time [us]": round(float(np.median(own)), 1),
        "p99 of processor time [us]": round(float(np.percentile(own, 99)), 1),
    }


def measure_parts(seed: int) -> Row:
    """Time the parts of a tick while walking."""
    ticks: list[float] = []
    spans: dict[str, list[list[float]]] = {}
    with ExitStack() as stack:
        for part, functions in PARTS.items():
            for owner, name in functions:
                spans.setdefault(part, []).append([])
                stack.enter_context(replaced(owner, name, stopwatch(spans[part][-1], time.perf_counter)))
        stack.enter_context(replaced(Motion, "tick", stopwatch(ticks, time.perf_counter)))
        walk(seed)
    medians = {part: sum(float(np.median(each)) for each in lists) for part, lists in spans.items()}
    medians["rest"] = float(np.median(ticks)) - sum(medians.values())
    return {"tick": "parts", "seed": seed, **{f"{part} [us]": round(1e6 * s, 1) for part, s in medians.items()}}


def solver_times(rows: Sequence[Row]) -> dict[str, float]:
    """Return the median over the rounds of each solver's median time [us]."""
    return {
        name: float(np.median([row["median [us]"] for row in rows if row.get("solver") == name]))
        for name in clik_solvers.SOLVERS
    }


def part_times(rows: Sequence[Row]) -> dict[str, float]:
    """Return the median over the seeds of each part's time [us]."""
    own = [row for row in rows if row.get("tick") == "parts"]
    return {part: float(np.median([row[f"{part} [us]"] for row in own])) for part in (*PARTS, "rest")}


def summarize(rows: list[Row]) -> list[str]:
    """Return the table of solvers, the tick and its parts."""
    times = solver_times(rows)
    pink = min(times["Pink"], times["Pink with limits"])
    first = {name: next(row for row in rows if row.get("solver") == name) for name in clik_solvers.SOLVERS}
    lines = [
        "One walk, recorded from the simulation; the same model and tasks (CoM, torso's orientation, other foot; stance"
        f" foot fixed) for all; {ROUNDS} rounds of all solvers in turn, {first['ours']['solves']} solves each. A solve"
        " is kinematics, solution and integration. Pink and PlaCo are asked for the place at the end of the tick, in"
        " one tick; so is our solver in the row dead-beat. As motion control runs it, it gets place and velocity of"
        " now, and closes errors with 20 / s, which takes the jumps out that a landing foot leaves in the targets.",
        "",
        "| solver | median | p99 | ratio | CoM, RMS | torso | other foot | stance foot | remark |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for name, row in first.items():
        p99 = float(np.median([other["p99 [us]"] for other in rows if other.get("solver") == name]))
        lines.append(
            f"| {name} | {times[name]:.1f} us | {p99:.0f} us | {times[name] / times['ours']:.2f}"
            f" | {row['CoM RMS [mm]']:.3f} mm | {row['torso RMS [mrad]']:.3f} mrad"
            f" | {row['foot RMS [mm]']:.3f} mm, {row['foot RMS [mrad]']:.3f} mrad"
            f" | {1000.0 * row['stance foot RMS [mm]']:.1f} um | {row['remark']} |"
        )
    ticks = [row for row in rows if row.get("tick") == "whole"]
    median, p99, own, own_p99 = (
        float(np.median([row[name] for row in ticks]))
        for name in ("median [us]", "p99 [us]", "median of processor time [us]", "p99 of processor time [us]")
    )
    lines += [
        "",
        f"Ours takes {times['ours'] / pink:.2f} of Pink's time at its fastest (asked for: a third at most), and"
        f" {times['ours'] / times['PlaCo']:.1f} times that of PlaCo, which is C++ throughout.",
        "",
        f"Whole control tick while walking in the simulation, {sum(row['ticks'] for row in ticks)} ticks, median of"
        f" {len(ticks)} seeds: **{median:.0f} us median, {p99:.0f} us p99** by the clock,"
        f" {own:.0f} and {own_p99:.0f} us of processor time (asked for: {BARS[0]:.0f} and {BARS[1]:.0f} us).",
        "",
        "| part of the tick | median | share |",
        "| --- | --- | --- |",
    ]
    parts = part_times(rows)
    whole = sum(parts.values())
    lines += [f"| {part} | {value:.1f} us | {100.0 * value / whole:.0f} % |" for part, value in parts.items()]
    lines += ["", "Each part's figure holds some 0.2 us of the stopwatch, and the rest as much for each part."]
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw solvers and parts of the tick as bars."""
    figure = Figure(figsize=(9.0, 3.2), layout="constrained")
    axes = figure.subplots(1, 2)
    for axis, values, title in (
        (axes[0], solver_times(rows), "one solve of inverse kinematics"),
        (axes[1], part_times(rows), "parts of one control tick"),
    ):
        bars = axis.barh(list(values), list(values.values()), color="tab:blue")
        axis.bar_label(bars, fmt=" %.1f")
        axis.invert_yaxis()
        axis.set_xlim(0.0, 1.2 * max(values.values()))  # room for the figures
        axis.set(title=title, xlabel="median [us]")
    figure.savefig(path, dpi=120)


BENCH = Bench(
    "clik",
    "Inverse kinematics and the control tick",
    [
        *(("solver", name) for _ in range(ROUNDS) for name in clik_solvers.SOLVERS),
        *((what, seed) for seed in TICK_SEEDS for what in ("tick", "parts")),
    ],
    measure,
    summarize,
    draw,
    workers=1,
    prepare=clik_solvers.prepare,
)
