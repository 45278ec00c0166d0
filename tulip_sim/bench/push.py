"""Pushes: the greatest impulse that the robot survives, by direction and by the phase of the step."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.projections.polar import PolarAxes

from tulip_description.planar import Pose2D
from tulip_motion.interface import MotionMode, Side, WalkCommand, WalkMode
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench.body import Body
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.timing import TICK

DIRECTIONS = tuple(range(0, 360, 45))  # [deg] of the force, 0 forward, 90 to the left
PHASES: tuple[float | None, ...] = (0.05, 0.2, 0.4, 0.6, 0.8, None)  # of a step on the left foot; None: standing
SEEDS = 4
SPEED = 0.2  # [m/s] of the walk
PULSE = 100  # [ms]
FIRST, LAST = 8, 16  # [N s] weakest and strongest push, in steps of 1
BEFORE = 8.0  # [s] of walking in which the phase has to come
AFTER = 4.0  # [s] to stay upright after the push
TICKS_PER_SECOND = 1000 / TICK
BAR = 10.0  # [N s]
HUB = 2.5  # rings' widths: the picture's empty middle, where a text stands


def measure(direction: int, phase: float | None, seed: int) -> Row:
    """Push ever harder, each time from a fresh start, until the robot falls; count down if it falls at once."""
    impulse = FIRST
    if survives(direction, phase, impulse, seed):
        while impulse < LAST and survives(direction, phase, impulse + 1, seed):
            impulse += 1
    else:
        impulse -= 1
        while impulse > 0 and not survives(direction, phase, impulse, seed):
            impulse -= 1
    return {"direction [deg]": direction, "phase": phase, "seed": seed, "survived [N s]": impulse}


def survives(direction: int, phase: float | None, impulse: float, seed: int) -> bool:
    """Return whether the robot stays upright after one push on its torso."""
    return time_upright(direction, phase, impulse, seed) >= AFTER


def time_upright(
    direction: float, phase: float | None, impulse: float, seed: int, parameters: MotionParameters | None = None
) -> float:
    """Push a robot once and return how long it stays upright after it.

    Args:
        direction: Of the force on the torso [deg], 0 forward, 90 to the left.
        phase: Of a step on the left foot, after the first steps of a walk; None while standing.
        impulse: [N s].
        seed: Of the world.
        parameters: Of motion control, by default the committed ones.

    Returns:
        The time until it falls [s], AFTER if it does not; 0 if it falls, or never gets there, before the push.
    """
    body = Body(seed, Pose2D(), parameters=parameters)
    body.go(0.5)
    command = WalkCommand(0, WalkMode.STAND)
    if phase is not None:
        command = WalkCommand(0, WalkMode.WALK, (SPEED, 0.0, 0.0))
        # The first steps speed up; the phase is that of the first step on the left foot after them.
        for _ in range(round(BEFORE * TICKS_PER_SECOND)):
            if _is_at(body, phase):
                break
            if body.fallen:
                return 0.0
            body.tick(command)
        else:
            return 0.0
    angle, force = math.radians(direction), 1000.0 * impulse / PULSE
    body.world.push([force * math.cos(angle), force * math.sin(angle), 0.0], PULSE)
    for k in range(round(AFTER * TICKS_PER_SECOND)):
        body.tick(command)
        if body.fallen:
            return k / TICKS_PER_SECOND
    return AFTER


def _is_at(body: Body, phase: float) -> bool:
    state = body.motion.state()
    on_left = body.motion.stance is Side.LEFT
    return state.mode is MotionMode.WALK and state.step_count >= 4 and on_left and state.phase >= phase


def summarize(rows: list[Row]) -> list[str]:
    """Return the worst impulses by direction, and the whole map."""
    seeds = len({row["seed"] for row in rows})
    directions = sorted({row["direction [deg]"] for row in rows})
    phases = [phase for phase in PHASES if any(row["phase"] == phase for row in rows)]

    def worst(direction: int, phase: float | None) -> int:
        own = [row for row in rows if row["direction [deg]"] == direction and row["phase"] == phase]
        return min(int(row["survived [N s]"]) for row in own)

    names = ["standing" if phase is None else f"phase {phase}" for phase in phases]
    lines = [
        f"Impulse of {PULSE / 1000:.1f} s on the torso, in steps of 1 N s up to {LAST}, while walking {SPEED} m/s, at"
        f" phases of a step on the left foot, and while standing. The greatest impulse up to which the robot stayed"
        f" upright, least of {seeds} random worlds. 0 deg is forward, 90 to the left, which is over the standing"
        " foot; the right foot mirrors it.",
        "",
        f"| direction | {' | '.join(names)} | worst |",
        "| --- |" + " --- |" * (len(phases) + 1),
    ]
    for direction in directions:
        values = [worst(direction, phase) for phase in phases]
        lines.append(f"| {direction} deg | {' | '.join(str(value) for value in values)} | {min(values)} N s |")
    every = [row["survived [N s]"] for row in rows]
    good = sum(value >= BAR for value in every)
    return [*lines, "", f"- {BAR:.0f} N s survived in {good} of {len(every)} cases; median {np.median(every):.0f} N s"]


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the map: direction round the circle, phase outwards, standing in the middle."""
    figure = Figure(figsize=(6.4, 5.2), layout="constrained")
    axes = figure.add_subplot(projection="polar")
    assert isinstance(axes, PolarAxes)
    phases = [phase for phase in (None, *PHASES[:-1]) if any(row["phase"] == phase for row in rows)]
    values = np.array(
        [
            [
                min(row["survived [N s]"] for row in rows if row["phase"] == p and row["direction [deg]"] == d)
                for d in DIRECTIONS
            ]
            for p in phases
        ]
    )
    colours = ScalarMappable(Normalize(0, LAST), "RdYlGn")
    width = 2.0 * math.pi / len(DIRECTIONS)
    for i in range(len(phases)):
        axes.bar(np.radians(DIRECTIONS), 1.0, width, HUB + i, color=colours.to_rgba(values[i]))
        for j, direction in enumerate(DIRECTIONS):
            axes.text(math.radians(direction), HUB + i + 0.5, str(values[i, j]), ha="center", va="center", fontsize=9)
    axes.set_theta_zero_location("N")
    axes.set_yticks(
        HUB + np.arange(len(phases)) + 0.5,
        ["" if phase is None else f"{phase:.2f}" for phase in phases],
        fontsize=7,
    )
    axes.set_thetagrids(DIRECTIONS, ["forward", "", "left", "", "back", "", "right", ""])
    axes.grid(False)
    if phases[0] is None:
        axes.text(0.0, 0.0, "inner ring:\nstanding", ha="center", va="center", fontsize=8)
    figure.colorbar(colours, ax=axes, label="impulse survived [N s], least of the seeds")
    axes.set_title("Pushes by direction and phase of a step on the left foot")
    figure.savefig(path, dpi=110)


BENCH = Bench(
    "push",
    "Pushes",
    [(direction, phase, seed) for direction in DIRECTIONS for phase in PHASES for seed in range(SEEDS)],
    measure,
    summarize,
    draw,
)
