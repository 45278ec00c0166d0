"""Curves of bench `simcheck` and the picture of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

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
"""Times [s] and values by label."""

POINTS = 250  # of a curve, about
HIP = ("left_hip_roll", "left_hip_pitch")
STYLES = {
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
"""By the label's part before a colon."""


def _by_engine(value: Callable[[Run], Array], spacing: float = 1e-3) -> Callable[..., Curves]:
    """Return what draws a figure of each reference and of the simulator at its own step."""

    def found(study: Study, runs: Mapping[int, Run], references: Mapping[str, Run]) -> Curves:
        every = {"pybullet": runs[1], **references}
        values = {label: value(run) for label, run in every.items()}
        return {label: (spacing * np.arange(len(each)), each) for label, each in values.items()}

    return found


def _by_step(value: Callable[[Run], Array], bound: str = "", sides: tuple[int, ...] = (1,)) -> Callable[..., Curves]:
    """Return what draws a figure of the simulator with each of its steps, and the bound at its own one."""

    def found(study: Study, runs: Mapping[int, Run], references: Mapping[str, Run]) -> Curves:
        values = {f"pybullet, {1 / substeps:g} ms": value(run) for substeps, run in runs.items()}
        curves = {label: (1e-3 * np.arange(len(each)), each) for label, each in values.items()}
        for check in study.check(runs[1], 1):
            if check.what == bound:
                times = next(iter(curves.values()))[0][[0, -1]]
                for side in sides:
                    curves[f"bound:{side}"] = (times, np.full(2, side * check.bound))
        return curves

    return found


def _hip(study: Study, runs: Mapping[int, Run], references: Mapping[str, Run]) -> Curves:
    curves = {}
    for label, run in {"pybullet": runs[1], **references}.items():
        for name in HIP:
            angles = run.recording.joints[:, JOINTS.index(name)]
            curves[f"{label}:{name}"] = (1e-3 * np.arange(len(angles)), angles)
    return curves


def _apart(study: Study, runs: Mapping[int, Run], references: Mapping[str, Run]) -> Curves:
    other = references["forward dynamics"].recording.joints
    return _by_step(lambda run: 1e3 * np.abs(run.recording.joints - other).max(axis=1))(study, runs, references)


def _force(run: Run) -> Array:
    return 1e3 * run.recording.contact[:120, 2]


PANELS: tuple[tuple[str, str, str, Callable[..., Curves]], ...] = (
    ("leg swings, loose", "hip roll (from -0.1) and pitch (from -1.2)", "angle [rad]", _hip),
    ("leg swings, loose", "difference from forward dynamics", "greatest of all joints [mrad]", _apart),
    (
        "leg swings, loose",
        "energy that no work explains",
        "[J]",
        _by_step(lambda run: run.balance.energy_error, "energy from nowhere"),
    ),
    (
        "flight",
        "spin about the CoM, though nothing turns it",
        "[N m s]",
        _by_step(lambda run: np.linalg.norm(run.balance.spin_error, axis=1), "spin about the CoM"),
    ),
    ("drop from 3 cm", "force of the ground", "[N]", _by_engine(_force)),
    (
        "drop from 3 cm",
        "energy that the ground has taken",
        "[J]",
        _by_engine(lambda run: -run.balance.energy_error),
    ),
    ("standing, pushed left", "CoM to the left", "[mm]", _by_engine(lambda run: 1e3 * run.balance.com[:, 1])),
    (
        "standing, pushed left",
        f"CoP to the left, means of {SMOOTHING} ms",
        "[mm]",
        _by_engine(lambda run: 1e3 * smooth_cop(run.recording)[:, 1], 1e-3 * SMOOTHING),
    ),
    (
        "landing at 0.3 m/s",
        "vertical impulse of the ground so far",
        "[N s]",
        _by_engine(lambda run: np.concatenate([[0.0], np.cumsum(run.recording.contact[:, 2])])),
    ),
)
"""Experiment, what the panel shows, its unit, and how it comes from the runs."""


def curves(
    study: Study, name: str, runs: Mapping[int, Run], references: Mapping[str, Run]
) -> dict[str, dict[str, list[list[float]]]]:
    """Return the curves of an experiment's panels: times [s] and values, by panel and label."""
    found: dict[str, dict[str, list[list[float]]]] = {}
    for experiment, title, _, make in PANELS:
        if experiment == name:
            found[title] = {
                label: [[float(f"{value:.5g}") for value in each[:: max(1, len(each) // POINTS)]] for each in curve]
                for label, curve in make(study, runs, references).items()
            }
    return found


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw all panels whose experiments are among the rows."""
    by_name = {row["experiment"]: row["curves"] for row in rows}
    panels = [panel for panel in PANELS if panel[0] in by_name]
    height = -(-len(panels) // 3)
    figure = Figure(figsize=(14.0, 3.6 * height), layout="constrained")
    FigureCanvasAgg(figure)
    for index, (name, title, unit, _) in enumerate(panels):
        axes = figure.add_subplot(height, 3, index + 1)
        seen = set()
        for label, (times, values) in by_name[name][title].items():
            kind = label.split(":")[0]
            axes.plot(times, values, label=None if kind in seen else kind, **({"linewidth": 1.3} | STYLES[kind]))
            seen.add(kind)
        if name.startswith("standing"):
            axes.axvspan(1e-3 * SETTLE, 1e-3 * (SETTLE + PULSE), color="tab:orange", alpha=0.2, label="push")
        axes.set_title(f"{name}: {title}", fontsize=9)
        axes.set_xlabel("time [s]")
        axes.set_ylabel(unit)
        axes.grid(alpha=0.3)
        axes.legend(fontsize=7)
    figure.savefig(path, dpi=100)
