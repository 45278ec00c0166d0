"""Curves of bench `simcheck` and the picture of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import NDArray

from tulip_description.robot import JOINTS
from tulip_sim.bench.runner import Row
from tulip_sim.simcheck.differences import SMOOTHING, smooth_cop
from tulip_sim.simcheck.standing_push import PULSE, SETTLE
from tulip_sim.simcheck.study import Run, Study

Array = NDArray[np.float64]
Curves = dict[str, tuple[Array, Array]]
"""Times [ms] and values by label."""
Make = Callable[[Study, Mapping[int, Run], Mapping[str, Run]], Curves]
"""Makes curves of a study from the simulator's runs, by steps a millisecond, and those of the references, by name."""

POINTS = 120  # of a curve, about
LANDED = slice(55, 115)  # [ms] around the moment when what falls 2 or 3 cm touches the ground: 64, 78 ms
HIP = {"roll": JOINTS.index("left_hip_roll"), "pitch": JOINTS.index("left_hip_pitch")}
STYLES: dict[str, dict[str, Any]] = {
    "pybullet": {"color": "tab:blue"},
    "pybullet, 1 ms": {"color": "tab:blue"},
    "pybullet, 0.5 ms": {"color": "tab:cyan"},
    "pybullet, 0.25 ms": {"color": "tab:green"},
    "forward dynamics": {"color": "black", "linestyle": "--"},
    "stiff ground": {"color": "black", "linestyle": "--"},
    "soft ground": {"color": "0.6", "linestyle": ":"},
    "rigid impact": {"color": "tab:red", "linestyle": "-."},
    "bound": {"color": "tab:red", "linewidth": 0.8},
}
"""By a label, or its part before a colon; what is behind it is written beside the curve."""


def _by_engine(value: Callable[[Run], Array], spacing: int = 1, begin: int = 0) -> Make:
    """Return what makes curves of each reference and of the simulator at its own step, from a time on [ms]."""

    def found(study: Study, runs: Mapping[int, Run], references: Mapping[str, Run]) -> Curves:
        every = {"pybullet": runs[1], **references}
        values = {label: value(run) for label, run in every.items()}
        return {label: _curve(each, spacing, begin) for label, each in values.items()}

    return found


def _by_step(value: Callable[[Run], Array], bound: str = "") -> Make:
    """Return what makes curves of the simulator with each of its steps, and a line at the bound for its own one."""

    def found(study: Study, runs: Mapping[int, Run], references: Mapping[str, Run]) -> Curves:
        values = {f"pybullet, {1 / substeps:g} ms": value(run) for substeps, run in runs.items()}
        curves = {label: _curve(each) for label, each in values.items()}
        for check in study.check(runs[1], 1):
            if check.what == bound:
                curves["bound"] = (np.array([0.0, len(runs[1].recording.push)]), np.full(2, check.bound))
        return curves

    return found


def _hip(study: Study, runs: Mapping[int, Run], references: Mapping[str, Run]) -> Curves:
    curves = {}
    for label, run in {"pybullet": runs[1], **references}.items():
        for axis, joint in HIP.items():
            curves[f"{label}:{axis}"] = _curve(run.recording.joints[:, joint])
    return curves


def _apart(study: Study, runs: Mapping[int, Run], references: Mapping[str, Run]) -> Curves:
    other = references["forward dynamics"].recording.joints
    return _by_step(lambda run: 1e3 * np.abs(run.recording.joints - other).max(axis=1))(study, runs, references)


def _force(run: Run) -> Array:
    force: Array = 1e3 * run.recording.contact[:, 2]  # [N] from [N s] a millisecond
    return force[LANDED]


def _spin_error(run: Run) -> Array:
    size: Array = np.linalg.norm(run.balance.spin_error, axis=1)
    return size


def _ankle_roll(run: Run) -> Array:
    angles = 1e3 * run.recording.joints[LANDED, JOINTS.index("left_ankle_roll")]
    turned: Array = angles - angles[0]
    return turned


def _depth(run: Run) -> Array:
    return np.concatenate([[0.0], 1e3 * run.recording.depth])


def _impulse(run: Run) -> Array:
    return np.concatenate([[0.0], np.cumsum(run.recording.contact[:, 2])])


def _curve(values: Array, spacing: int = 1, begin: int = 0) -> tuple[Array, Array]:
    """Return the times of values that follow each other [ms], and the values, so many that a picture shows them."""
    every = max(1, len(values) // POINTS)
    times: Array = begin + spacing * np.arange(len(values), dtype=np.float64)
    return times[::every], values[::every]


class Panel(NamedTuple):
    """One diagram of the picture: of which experiment, what it shows, the unit, and how it is made."""

    experiment: str
    title: str
    unit: str
    make: Make


PANELS = (
    Panel("leg swings, loose", "angles of the hip", "[rad]", _hip),
    Panel("leg swings, loose", "difference from forward dynamics", "greatest of all joints [mrad]", _apart),
    Panel(
        "leg swings, loose",
        "energy that no work explains",
        "[J]",
        _by_step(lambda run: run.balance.energy_error, "energy from nowhere"),
    ),
    Panel("flight", "spin about the CoM that nothing explains", "[N m s]", _by_step(_spin_error, "spin about the CoM")),
    Panel("drop from 3 cm", "force of the ground", "[N]", _by_engine(_force, begin=LANDED.start)),
    Panel("drop from 3 cm", "energy lost", "[J]", _by_engine(lambda run: -run.balance.energy_error)),
    Panel("standing, pushed left", "CoM to the left", "[mm]", _by_engine(lambda run: 1e3 * run.balance.com[:, 1])),
    Panel(
        "standing, pushed left",
        f"CoP to the left, means of {SMOOTHING} ms",
        "[mm]",
        _by_engine(lambda run: 1e3 * smooth_cop(run.recording)[:, 1], SMOOTHING),
    ),
    Panel("drop from 2 cm", "left ankle rolls", "[mrad]", _by_engine(_ankle_roll, begin=LANDED.start)),
    Panel("landing at 0.3 m/s, loose", "vertical impulse of the ground so far", "[N s]", _by_engine(_impulse)),
    Panel("landing at 0.3 m/s, driven", "vertical impulse of the ground so far", "[N s]", _by_engine(_impulse)),
    Panel("landing at 0.5 m/s, loose", "depth of a sole", "[mm]", _by_step(_depth, "depth of a sole")),
)


def curves(
    study: Study, name: str, runs: Mapping[int, Run], references: Mapping[str, Run]
) -> dict[str, dict[str, list[list[float]]]]:
    """Return the curves of an experiment's panels: times [ms] and values, by panel and label."""
    found: dict[str, dict[str, list[list[float]]]] = {}
    for panel in PANELS:
        if panel.experiment == name:
            found[panel.title] = {
                label: [[float(f"{value:.5g}") for value in each] for each in curve]
                for label, curve in panel.make(study, runs, references).items()
            }
    return found


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw all panels whose experiments are among the rows."""
    by_name = {row["experiment"]: row["curves"] for row in rows}
    panels = [panel for panel in PANELS if panel.experiment in by_name]
    height = -(-len(panels) // 3)
    figure = Figure(figsize=(14.0, 3.6 * height), layout="constrained")
    FigureCanvasAgg(figure)
    for index, (name, title, unit, _) in enumerate(panels):
        axes = figure.add_subplot(height, 3, index + 1)
        seen = set()
        for label, (times, values) in by_name[name][title].items():
            kind, _, part = label.partition(":")
            if kind == "pybullet":
                axes.annotate(part, (times[0], values[0]), fontsize=8)
            axes.plot(times, values, label=None if kind in seen else kind, **({"linewidth": 1.3} | STYLES[kind]))
            seen.add(kind)
        if name.startswith("standing"):
            axes.axvspan(SETTLE, SETTLE + PULSE, color="tab:orange", alpha=0.2, label="push")
        axes.set_title(f"{name}: {title}", fontsize=9)
        axes.set_xlabel("time [ms]")
        axes.set_ylabel(unit)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7)
    figure.savefig(path, dpi=100)
