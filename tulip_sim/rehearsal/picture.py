"""A picture of a rehearsal: torques, speeds and the margin of the centre of pressure over time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tulip_description.robot import LEG_JOINTS
from tulip_motion.saturation import AT_LIMIT
from tulip_sim.rehearsal.motions import STAND
from tulip_sim.rehearsal.verdict import Limits
from tulip_sim.rehearsal.watch import Course

Array = NDArray[np.float64]
POINTS = 600  # in a line at most: peaks are kept
NAMES = 12  # of parts that fit beside each other
LEG = len(LEG_JOINTS) // 2
COLOURS = ("tab:blue", "tab:orange", "tab:green", "tab:red", "tab:purple", "tab:brown")


def draw(courses: Sequence[Course], limits: Limits, path: Path) -> None:
    """Draw all plays.

    Args:
        courses: Of all plays.
        limits: That the motion is held to.
        path: Of the picture, whose ending tells its kind.
    """
    figure = Figure(figsize=(11.0, 8.5), layout="constrained")
    torques, speeds, margins = figure.subplots(3, 1, sharex=True)
    for axis, all_values in (
        (torques, [each.torques for each in courses]),
        (speeds, [each.speeds for each in courses]),
    ):
        times, worst = _worst(courses, all_values)
        for index, colour in enumerate(COLOURS):
            name = LEG_JOINTS[index].removeprefix("left_").replace("_", " ")
            axis.plot(*_peaks(times, worst[:, index]), color=colour, linewidth=0.9, label=name)
    for course in courses:
        times, lows = _peaks(course.times, -1e3 * course.margins)
        margins.plot(times, -lows, linewidth=0.8, label=f"seed {course.seed}")
        if course.fall:
            for axis in (torques, speeds, margins):
                axis.axvline(course.times[-1], color="black", linewidth=1.5)
            margins.annotate("falls", (course.times[-1], 5.0), ha="right")
    for axis, level in ((torques, AT_LIMIT), (speeds, limits.speed), (margins, 1e3 * limits.edge)):
        axis.axhline(level, color="red", linewidth=0.8, linestyle="--")
    torques.set(ylabel="torque / limit", ylim=(0.0, 1.1))
    speeds.set(ylabel="speed / limit", ylim=(0.0, 1.1))
    margins.set(ylabel="centre of pressure to edge [mm]", xlabel="time [s]")
    margins.set_ylim(bottom=0.0)
    torques.legend(fontsize="small", ncols=LEG, title="greatest of both legs and all plays")
    margins.legend(fontsize="small", ncols=len(courses), loc="upper right")
    _name_parts(torques, courses[0])
    figure.savefig(path, dpi=110)


def _worst(courses: Sequence[Course], values: Sequence[Array]) -> tuple[Array, Array]:
    """Return the times of the longest play, and (t, 6) the greatest value of each joint in both legs and all plays."""
    longest = max((course.times for course in courses), key=len)
    worst = np.zeros((len(longest), LEG))
    for each in values:
        legs = np.abs(each[:, : 2 * LEG]).reshape(-1, 2, LEG).max(axis=1)
        worst[: len(legs)] = np.maximum(worst[: len(legs)], legs)
    return longest, worst


def _peaks(times: Array, values: Array) -> tuple[Array, Array]:
    """Return at most POINTS points, each the greatest of its stretch; NaN where a stretch has no value."""
    window = -(-len(times) // POINTS)
    whole = len(times) // window * window
    stretches = np.where(np.isnan(values[:whole]), -np.inf, values[:whole]).reshape(-1, window).max(axis=1)
    return times[:whole:window], np.where(np.isinf(stretches), np.nan, stretches)


def _name_parts(axis: Axes, course: Course) -> None:
    """Write above the axis what is played but for stands; of short parts, only what there is room for."""
    room = float(course.times[-1]) / NAMES
    ends = [begin for begin, _ in course.beginnings[1:]] + [float(course.times[-1])]
    written = -room
    for (begin, words), end in zip(course.beginnings, ends, strict=True):
        axis.axvline(begin, color="grey", linewidth=0.5, linestyle=":")
        if words != STAND and begin - written >= room and end - begin >= 0.5 * room:
            axis.text(begin, 1.12, words, fontsize="small", rotation=15, ha="left", va="bottom")
            written = begin
