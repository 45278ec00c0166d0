"""Iterative learning control: joint error step by step, without it, with the paper's law, with a waveform."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tulip_description.planar import Pose2D
from tulip_motion.interface import WalkCommand, WalkMode
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.parameters import WorldParameters

Array = NDArray[np.float64]

STANDARD = WorldParameters()
ROBOTS = {
    "nominal": STANDARD,
    "heavier, with friction": replace(STANDARD, mass_scale=1.1, joint_friction=(0.02, 0.04)),
}
LAWS = ("none", "adaptive", "waveform")
SEEDS = (1, 2, 3)
STEPS = 220
SPEED = 0.2  # [m/s]
FIRST = 3  # the first step that teaches: the first shifts the weight, the second gains speed
TEN = 10  # steps
START = Pose2D(-4.0, 2.2, 0.0)
MEASURED, TRUE = "joint error by encoders, each step [mrad]", "true joint error, each step [mrad]"


def measure(robot: str, law: str, seed: int) -> Row:
    """Walk straight ahead and take the RMS of the error of the twelve joints over each step.

    The error at a tick is that of the desired angles that are in force, which the tick before sent; against what the
    encoders say (0-2 ms old, as motion control sees it) and against what is true.
    """
    body = Body(seed, START, parameters=MotionParameters(learning=law), world=ROBOTS[robot])
    body.go(0.5)
    command = WalkCommand(0, WalkMode.WALK, (SPEED, 0.0, 0.0))
    state = body.motion.state()
    first = state.step_count
    errors: list[list[Array]] = [[], []]
    found: list[list[float]] = [[], []]
    greatest = 0.0
    while not body.fallen:
        before, true = state, body.world.truth().joint_positions[:12]
        body.tick(command)
        state = body.motion.state()
        if state.step_count != before.step_count and errors[0]:
            for values, kept in zip(found, errors, strict=True):
                values.append(round(1e3 * float(np.sqrt(np.mean(np.square(kept)))), 3))
                kept.clear()
            if state.step_count - first > STEPS:
                break
        errors[0].append(before.joint_positions_desired - state.joint_positions)
        errors[1].append(before.joint_positions_desired - true)
        greatest = max(greatest, float(np.abs(state.torque_learned).max()))
    return {
        "robot": robot,
        "learning": law,
        "seed": seed,
        "upright": not body.fallen,
        "greatest learned torque [N m]": round(greatest, 2),
        "notes": "; ".join(state.notes),
        MEASURED: found[0],
        TRUE: found[1],
    }


def ratios(row: Row, rows: Sequence[Row], name: str) -> tuple[float, float, float]:
    """Return the mean error without learning [mrad], and with it by that: mean, and worst ten steps running.

    Counted from the tenth step after the first that teaches.
    """
    begin = FIRST + TEN
    plain = _find(rows, row["robot"], "none", row["seed"])[name][begin:]
    own = np.array(row[name][begin:])
    without = float(np.mean(plain))
    running = np.convolve(own, np.full(TEN, 1.0 / TEN), "valid")
    return without, float(own.mean()) / without, float(running.max()) / without


def summarize(rows: list[Row]) -> list[str]:
    """Return a table, one line a robot and law."""
    steps = min(len(row[MEASURED]) for row in rows)
    lines = [
        f"RMS of the error of the twelve joints over each step, walking straight ahead at {SPEED} m/s for {steps} steps"
        f" or more; {len({row['seed'] for row in rows})} seeds, randomised as for walking. Ratios are to the same seed"
        f" without learning, from {TEN} steps after the first that teaches; the worst is over ten steps running, the"
        " bar for it 0.5. The heavier robot has all masses +10 % and joint friction of 2-4 % of the torque limits, and"
        " motion control knows of neither.",
        "",
        "| robot | learning | error without | ratio by encoders: mean, worst of all seeds | true ratio: mean, worst"
        " | seeds within the bar, true | torque, most | upright | switched off |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for robot in dict.fromkeys(row["robot"] for row in rows):
        for law in dict.fromkeys(row["learning"] for row in rows):
            own = [row for row in rows if row["robot"] == robot and row["learning"] == law]
            if not own:
                continue
            upright = [row for row in own if len(row[MEASURED]) > FIRST + 2 * TEN]
            cells = [f"| {robot} | {law} | none got so far |  |  |  "]
            if upright:
                seen = np.array([ratios(row, rows, MEASURED) for row in upright])
                true = np.array([ratios(row, rows, TRUE) for row in upright])
                cells = [
                    f"| {robot} | {law} | {seen[:, 0].mean():.1f} mrad"
                    f" | {seen[:, 1].mean():.2f}, {seen[:, 2].max():.2f}"
                    f" | {true[:, 1].mean():.2f}, {true[:, 2].max():.2f}"
                    f" | {int((true[:, 2] <= 0.5).sum())} of {len(own)} "
                ]
            lines.append(
                cells[0] + f"| {max(row['greatest learned torque [N m]'] for row in own):.1f} N m"
                f" | {sum(row['upright'] for row in own)} of {len(own)}"
                f" | {sum(bool(row['notes']) for row in own)} of {len(own)} |"
            )
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the learning curves: one line a seed, one colour a law."""
    robots = list(dict.fromkeys(row["robot"] for row in rows))
    figure = Figure(figsize=(4.5 * len(robots), 3.6), layout="constrained")
    FigureCanvasAgg(figure)
    colours = {"none": "0.5", "adaptive": "tab:orange", "waveform": "tab:blue"}
    for column, robot in enumerate(robots):
        axes = figure.add_subplot(1, len(robots), column + 1)
        for row in (row for row in rows if row["robot"] == robot):
            label = row["learning"] if row["seed"] == SEEDS[0] else None
            axes.plot(1 + np.arange(len(row[TRUE])), row[TRUE], color=colours[row["learning"]], lw=0.8, label=label)
        axes.set_title(robot)
        axes.set_xlabel("step")
        axes.set_ylim(bottom=0.0)
        axes.set_xscale("log")
        axes.grid(alpha=0.3)
    figure.axes[0].set_ylabel("true joint error, RMS of a step [mrad]")
    figure.axes[0].legend()
    figure.savefig(path, dpi=110)


def _find(rows: Sequence[Row], robot: str, law: str, seed: int) -> Row:
    return next(row for row in rows if (row["robot"], row["learning"], row["seed"]) == (robot, law, seed))


BENCH = Bench(
    "ilc",
    "Iterative learning control",
    [(robot, law, seed) for robot in ROBOTS for law in LAWS for seed in SEEDS],
    measure,
    summarize,
    draw,
)
