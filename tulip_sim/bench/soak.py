"""Hours of matches: does anything grow?

Lockstep: one process plays match after match. Graph: two robots and their simulator play one long match. Both write
samples to a folder as they go, and a folder that holds some already is continued: by a new process, whose samples
are a segment of their own. Slopes are fitted within segments.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tulip_sim.bench.runner import Bench, Row
from tulip_sim.bench.soaking import graph, lockstep, samples
from tulip_sim.bench.soaking.resources import FILES, MEMORY, THREADS
from tulip_sim.bench.soaking.samples import SIMULATED, Sample
from tulip_sim.bench.soaking.slopes import CONFIDENCE, Series, Slope, fit
from tulip_sim.match_settings import MatchSettings
from tulip_sim.perception import EYES
from tulip_sim.robot_stack import RobotSettings

HOURS, MINUTES = 8.0, 30.0  # of lockstep and of a graph, simulated
FOLDER = Path(__file__).parents[2] / "recordings" / "soak"
CHUNK = 0.25  # [h] of lockstep in one row
WARM_UP = {lockstep.MODE: 0.5, graph.MODE: 1.0 / 12.0}  # [h] of each process that is left out of the slopes
OF_NODES = (MEMORY, FILES, THREADS, graph.SERVICE, graph.PROCESSOR)
PERIOD = 8.0  # [h] for which the growth is told


def choose(options: Mapping[str, str]) -> list[tuple[str, float, str, str]]:
    """Return what is played.

    Args:
        options: hours of lockstep and minutes of a graph [simulated], folder of the samples, and eyes of the lockstep,
            one of `EYES`.

    Raises:
        ValueError: for other options, or values that cannot be used.
    """
    known = {"hours": str(HOURS), "minutes": str(MINUTES), "folder": str(FOLDER), "eyes": "camera"}
    if not options.keys() <= known.keys():
        raise ValueError(f"options are {', '.join(options)}; expected some of {', '.join(known)}")
    chosen = known | dict(options)
    if chosen["eyes"] not in EYES:
        raise ValueError(f"eyes is {chosen['eyes']!r}; expected one of {', '.join(EYES)}")
    hours, minutes = float(chosen["hours"]), float(chosen["minutes"])
    if not (0.0 <= hours <= 1000.0 and 0.0 <= minutes <= 1000.0):
        raise ValueError(f"hours is {hours}, minutes {minutes}; expected 0 to 1000 each")
    if hours == minutes == 0.0:
        raise ValueError("hours and minutes are both 0, so there is nothing to play; expected more of one of them")
    folder, eyes = str(Path(chosen["folder"]).absolute()), chosen["eyes"]
    ends = [min(hours, CHUNK * (number + 1)) for number in range(math.ceil(hours / CHUNK - 1e-9))]
    trials = [(lockstep.MODE, end, folder, eyes) for end in ends]
    return trials + ([(graph.MODE, minutes / 60.0, folder, "camera")] if minutes > 0.0 else [])


def measure(mode: str, hours: float, folder: str, eyes: str) -> Row:
    """Play until a folder holds so many simulated hours, and return the samples of the last chunk of them."""
    place = Path(folder)
    if mode == lockstep.MODE:
        robot = RobotSettings(perception=EYES[eyes])
        lockstep.play_until(place, hours * 3600.0, MatchSettings(robots=(robot, robot)))
        begin = CHUNK * (math.ceil(hours / CHUNK - 1e-9) - 1)
        return {"mode": mode, "hours": hours, "segments": _chunk(samples.read(place, mode), begin, hours)}
    seconds = hours * 3600.0
    if not any(segment.duration >= seconds for segment in samples.read(place, mode)):
        graph.play(place, seconds)
    whole = [segment for segment in samples.read(place, mode) if segment.duration >= seconds]
    return {"mode": mode, "hours": hours, "segments": {whole[-1].name: whole[-1].samples}}


def _chunk(segments: Sequence[samples.Segment], begin: float, end: float) -> dict[str, list[Sample]]:
    """Return the samples from one time to another [h], in which the segments follow each other."""
    found: dict[str, list[Sample]] = {}
    passed = 0.0
    for segment in segments:
        within = [each for each in segment.samples if begin * 3600.0 < passed + each[SIMULATED] <= end * 3600.0]
        if within:
            found[segment.name] = within
        passed += segment.duration
    return found


def _segments(rows: Sequence[Row], mode: str) -> list[list[Sample]]:
    """Put chunks together again."""
    whole: dict[str, list[Sample]] = {}
    for row in rows:
        if row["mode"] == mode:
            for name, part in row["segments"].items():
                whole.setdefault(name, []).extend(part)
    return list(whole.values())


def _series(segments: Sequence[Sequence[Sample]], figure: str, part: str = "", node: str = "") -> list[Series]:
    """Return a figure of each segment: of the whole, or of a part of each sample, as of one node."""

    def of(sample: Sample) -> Sample:
        inner = sample[part] if part else sample
        return dict(inner.get(node, {})) if node else inner

    return [
        (
            np.array([each[SIMULATED] / 3600.0 for each in segment if figure in of(each)]),
            np.array([float(of(each)[figure]) for each in segment if figure in of(each)]),
        )
        for segment in segments
        if any(figure in of(each) for each in segment)
    ]


def summarize(rows: list[Row]) -> list[str]:
    """Return the slopes, and whether each figure is flat."""
    lines = [
        "Samples of what the processes hold while robots play with all their components. A straight line is fitted to"
        " each figure, within each process, after its warm-up; beside its slope stands half of the width of its"
        f" {CONFIDENCE:.0%} confidence interval, for as many independent samples as the correlation of neighbouring"
        " ones leaves. Flat: the interval holds zero. `at most`: what the upper end of the interval makes of"
        f" {PERIOD:.0f} hours. Memory is what is a process's own; shared memory counts as files. Hours are simulated.",
    ]
    played = _segments(rows, lockstep.MODE)
    if played:
        lines += ["", *_of_lockstep(played)]
    nodes = _segments(rows, graph.MODE)
    if nodes:
        lines += ["", *_of_graph(nodes)]
    return lines


def _of_lockstep(segments: list[list[Sample]]) -> list[str]:
    hours = sum(segment[-1][SIMULATED] for segment in segments) / 3600.0
    ended = [sample[lockstep.ENDED] for segment in segments for sample in segment if lockstep.ENDED in sample]
    counts = ", ".join(
        f"{sum(each[name] for each in ended)} {name}" for name in ("trials", "goals", "falls", "removals")
    )
    head = (
        f"Lockstep, one process that plays match after match: {hours:.2f} hours in {len(segments)} processes,"
        f" {len(ended)} whole matches with {counts}; a sample each minute, warm-up {WARM_UP[lockstep.MODE]:.1f} h."
    )
    figures = (MEMORY, FILES, THREADS, lockstep.SHARED, lockstep.OBJECTS, lockstep.PROCESSOR, lockstep.WALL)
    table = [_cells(figure, fit(_series(segments, figure), WARM_UP[lockstep.MODE])) for figure in figures]
    return [head, "", *_table("figure", table)]


def _of_graph(segments: list[list[Sample]]) -> list[str]:
    warm_up = WARM_UP[graph.MODE]
    events = [event for segment in segments for sample in segment for event in sample[graph.EVENTS]]
    head = (
        f"Graph, one long match of two robots: {sum(each[-1][SIMULATED] for each in segments) / 60.0:.1f} minutes,"
        f" a sample every {graph.PERIOD:.0f} s, warm-up {60.0 * warm_up:.0f} minutes."
        f" Processes that ended meanwhile: {len(events)}."
    )
    table = [
        _cells(figure, fit(_series(segments, figure, graph.WHOLE), warm_up))
        for figure in (graph.SHARED, graph.FACTOR, graph.PICTURE)
    ]
    lines = [head, "", *_table("figure", table), "", "Of each process, mean and slope by hour:", ""]
    cells = [("process", *OF_NODES), ("---",) * (1 + len(OF_NODES))]
    for node in _nodes(segments):
        of_node = (fit(_series(segments, figure, graph.NODES, node), warm_up) for figure in OF_NODES)
        cells.append((node, *(_cell(slope) for slope in of_node)))
    return lines + [f"| {' | '.join(row)} |" for row in cells]


def _nodes(segments: Sequence[Sequence[Sample]]) -> list[str]:
    return sorted({name for segment in segments for sample in segment for name in sample[graph.NODES]})


def _cell(slope: Slope | None) -> str:
    if slope is None:
        return ""
    return f"{slope.mean:.4g}; {slope.per_hour:+.2g} ± {slope.margin:.1g}, {slope.verdict}"


def _cells(name: str, slope: Slope | None) -> tuple[str, ...]:
    if slope is None:
        return (name, "", "", "", "", "", "unknown")
    most = PERIOD * max(0.0, slope.per_hour + slope.margin)
    return (
        name,
        *(f"{value:.4g}" for value in (slope.mean, slope.first, slope.last)),
        f"{slope.per_hour:+.3g} ± {slope.margin:.2g}",
        f"+{most:.3g}",
        slope.verdict,
    )


def _table(first: str, rows: Sequence[tuple[str, ...]]) -> list[str]:
    head = (first, "mean", "first fifth", "last fifth", "slope by hour", f"at most, in {PERIOD:.0f} h", "verdict")
    return [f"| {' | '.join(cells)} |" for cells in (head, ("---",) * len(head), *rows)]


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw what grows most easily: memory, and what a simulated second costs; memory of each node."""
    played, nodes = _segments(rows, lockstep.MODE), _segments(rows, graph.MODE)
    panels = 2 * bool(played) + bool(nodes)
    figure = Figure(figsize=(9.0, 1.0 + 2.4 * panels), layout="constrained")
    axes = list(figure.subplots(panels, 1, squeeze=False)[:, 0])
    for name in (MEMORY, lockstep.PROCESSOR) if played else ():
        axis = axes.pop(0)
        for times, values in _series(played, name):
            axis.plot(times, values, linewidth=0.8, marker=".", markersize=2.0)
        axis.set(xlabel="simulated time of the process [h]", ylabel=name, title="lockstep")
    if nodes:
        (axis,) = axes
        for index, node in enumerate(_nodes(nodes)):
            for times, values in _series(nodes, MEMORY, graph.NODES, node):
                style = {"color": f"C{index % 10}", "linestyle": "-" if index < 10 else "--", "linewidth": 0.9}
                axis.plot(60.0 * times, values - values[0], label=node, **style)
        axis.set(xlabel="simulated time [min]", ylabel="memory since the first sample [MB]", title="graph")
        axis.legend(fontsize="x-small", loc="center left", bbox_to_anchor=(1.0, 0.5))
    figure.savefig(path, dpi=120)


BENCH = Bench("soak", "Hours of matches", choose({}), measure, summarize, draw, workers=1, choose=choose)
