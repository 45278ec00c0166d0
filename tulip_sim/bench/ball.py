"""The ball and the opponents as the world model has them, against the truth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import chi2

from tulip_sim.bench.ball_trials import BOUND, SEEN, hidden, rolling, standing
from tulip_sim.bench.opponent_trials import opponents
from tulip_sim.bench.runner import Bench, Row

RANGES = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0)  # [m]
SPEEDS = (0.5, 1.0, 1.5, 2.0, 2.5, 3.0)  # [m/s]
STANDING_SEEDS, ROLLING_SEEDS, HIDDEN_SEEDS, OPPONENT_SEEDS = 2, 6, 6, 3
BARS = (5.0, 0.15)  # [%] of range, [m/s]
BOUND_OF_FOUR = float(chi2.ppf(0.95, df=4))


def measure(what: str, *arguments: object) -> Row:
    """Run one trial."""
    trials: dict[str, Callable[..., Row]] = {
        "standing": standing,
        "rolling": rolling,
        "hidden": hidden,
        "opponents": opponents,
    }
    return trials[what](*arguments)


def summarize(rows: list[Row]) -> list[str]:
    """Return the tables."""
    seen = any(row.get("perception") == "vision" for row in rows)
    source = "Rendered camera, real vision" if seen else "Features from the truth, as good and late as vision is"
    lines = [
        f"{source}; lockstep with physics, sensors and gait as in a match; the head as strategy moves it. A walking"
        " robot goes forward and back and turns to the ball. Everything relative to the robot, at the stamp of the"
        " newest odometry, the delay of vision included. NEES: squared error by the claimed covariance, 2 on average"
        f" for two values if that is right, and below {BOUND:.2f} in 95 %.",
        "",
    ]
    parts = (("standing", _standing), ("rolling", _rolling), ("hidden", _hidden), ("opponents", _opponents))
    for what, about in parts:
        part = [row for row in rows if row["what"] == what]
        if part:
            lines += about(part)
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw error against range, a rolling ball's speed and its error over time, and consistency."""
    figure = Figure(figsize=(10, 8), layout="constrained")
    axes = figure.subplots(2, 2)
    standing_rows = [row for row in rows if row["what"] == "standing"]
    rolling_rows = [row for row in rows if row["what"] == "rolling"]
    axis: Axes = axes[0, 0]
    for walks, colour in ((False, "tab:blue"), (True, "tab:orange")):
        of = [row for row in standing_rows if row["walks"] == walks]
        x, y = _joined(of, "range [m]"), _joined(of, "error [%]")
        axis.plot(x, y, ".", ms=3, color=colour, label="robot walks" if walks else "robot stands")
    axis.axhline(BARS[0], color="tab:red", lw=0.8, label="bar")
    axis.set(title="resting ball", xlabel="range [m]", ylabel="position error [% of range]", ylim=(0.0, None))
    axis.legend(fontsize="small")
    axis = axes[0, 1]
    shown = {row["speed [m/s]"]: row for row in rolling_rows if not row["comes"] and len(row["time [s]"]) > 5}
    for row in shown.values():
        (line,) = axis.plot(row["time [s]"], row["true speed [m/s]"], lw=0.8)
        believed = [math.nan if speed is None else speed for speed in row["believed speed [m/s]"]]
        axis.plot(row["time [s]"], believed, "--", color=line.get_color(), lw=1.2)
    axis.set(title="kicked ball: speed, true (line) and believed (dashed)", xlabel="time [s]", ylabel="[m/s]")
    axis = axes[1, 0]
    for speed in SPEEDS:
        errors = _joined([row for row in rolling_rows if row["speed [m/s]"] == speed], "velocity error [m/s]")
        axis.plot(np.full(len(errors), speed), errors, ".", ms=3, color="tab:blue", alpha=0.5)
    axis.axhline(BARS[1], color="tab:red", lw=0.8, label="bar")
    axis.set(title=f"seen rolling for {SEEN} s", xlabel="speed [m/s]", ylabel="velocity error [m/s]", ylim=(0.0, None))
    axis = axes[1, 1]
    parts = (
        ("resting ball", _joined(standing_rows, "position NEES"), 2),
        ("rolling ball", _joined(rolling_rows, "position NEES"), 2),
        ("its velocity", _joined(rolling_rows, "velocity NEES"), 2),
        ("opponents", _joined([row for row in rows if row["what"] == "opponents"], "NEES"), 4),
    )
    levels = np.linspace(0.01, 0.99, 99)
    for name, values, dimension in parts:
        if len(values):
            axis.plot(levels, chi2.cdf(np.quantile(values, levels), df=dimension), label=name)
    axis.plot((0.0, 1.0), (0.0, 1.0), color="black", lw=0.8, ls=":", label="honest")
    axis.set(
        title="consistency: below the line too careful, above too sure",
        xlabel="share of the looks",
        ylabel="claimed probability",
    )
    axis.legend(fontsize="small")
    figure.savefig(path, dpi=110)


def _standing(rows: Sequence[Row]) -> list[str]:
    lines = [
        "Resting ball, error of its position in % of its range (bar: 5 %), root mean square and 95 % quantile:",
        "",
        "| range [m] | " + " | ".join(f"{distance:g}" for distance in RANGES) + " |",
        "| --- |" + " --- |" * len(RANGES),
    ]
    for walks in (False, True):
        cells = []
        for distance in RANGES:
            errors = _joined([r for r in rows if r["walks"] == walks and r["distance [m]"] == distance], "error [%]")
            cells.append(f"{_rms(errors):.2f}, {np.percentile(errors, 95.0):.2f}" if len(errors) else "-")
        lines.append(f"| robot {'walks' if walks else 'stands'} | " + " | ".join(cells) + " |")
    nees = _joined(rows, "position NEES")
    lines += [
        "",
        f"- known in {np.mean([row['known [%]'] for row in rows]):.1f} % of the time; believed speed"
        f" {_rms(_joined(rows, 'speed [m/s]')):.3f} m/s root mean square",
        f"- {_consistency(nees, BOUND)}",
        "",
    ]
    return lines


def _rolling(rows: Sequence[Row]) -> list[str]:
    judged = [row for row in rows if row["velocity error [m/s]"]]
    lines = [
        f"Rolling ball, error of its velocity once it has been seen rolling for {SEEN} s (bar: 0.15 m/s), root mean"
        f" square and 95 % quantile; half were kicked before the robot, half came into view rolling. {len(judged)} of"
        f" {len(rows)} were in view that long:",
        "",
        "| speed [m/s] | " + " | ".join(f"{speed:g}" for speed in SPEEDS) + " |",
        "| --- |" + " --- |" * len(SPEEDS),
    ]
    for walks in (False, True):
        cells = []
        for speed in SPEEDS:
            of = [r for r in judged if r["walks"] == walks and r["speed [m/s]"] == speed]
            errors = _joined(of, "velocity error [m/s]")
            cells.append(f"{_rms(errors):.3f}, {np.percentile(errors, 95.0):.3f}" if len(errors) else "-")
        lines.append(f"| robot {'walks' if walks else 'stands'} | " + " | ".join(cells) + " |")
    stops = [row["stop error [m]"] for row in judged if row["stop error [m]"] is not None]
    return [
        *lines,
        "",
        f"- all: {_rms(_joined(judged, 'velocity error [m/s]')):.3f} m/s; position"
        f" {_rms(_joined(judged, 'position error [m]')):.3f} m; where it will stop, asked then: median"
        f" {np.median(stops):.2f} m off"
        if stops
        else "- none was in view that long",
        f"- position: {_consistency(_joined(judged, 'position NEES'), BOUND)}",
        f"- velocity: {_consistency(_joined(judged, 'velocity NEES'), BOUND)}",
        "",
    ]


def _hidden(rows: Sequence[Row]) -> list[str]:
    lines = []
    for rolls, name in ((False, "resting ball, an opponent walks past before it"), (True, "ball rolls behind one")):
        of = [row for row in rows if row["rolls"] == rolls]
        if of:
            errors = [row["greatest error [m]"] for row in of if row["greatest error [m]"] is not None]
            lines.append(
                f"- {name}: hidden for {np.mean([row['hidden [s]'] for row in of]):.2f} s"
                f" ({min(row['hidden [s]'] for row in of):.1f} to {max(row['hidden [s]'] for row in of):.1f} s), kept"
                f" {sum(row['kept'] for row in of)} of {len(of)} (bar: all); error meanwhile at most"
                f" {max(errors, default=math.nan):.2f} m; {_consistency(_joined(of, 'position NEES'), BOUND)}"
            )
    return [*lines, ""]


def _opponents(rows: Sequence[Row]) -> list[str]:
    lines = [
        "None to three opponents, without dynamics or pictures (the play of bench head), the head sweeping. NEES of"
        " four values, 4 if honest:",
        "",
        "| opponents | robot | confirmed | after, median [s] | position RMSE [m] | velocity RMSE [m/s] | mean NEES |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for walk in (False, True):
        for own in (False, True):
            of = [row for row in rows if row["walk"] == walk and row["own walk"] == own and row["count"]]
            if not of:
                continue
            after = _joined(of, "confirmed after [s]")
            lines.append(
                f"| {'walk' if walk else 'stand'} | {'walks' if own else 'stands'} | {sum(r['confirmed'] for r in of)}"
                f" of {sum(r['in view'] for r in of)} | {np.median(after) if len(after) else math.nan:.2f} |"
                f" {_rms(_joined(of, 'position error [m]')):.3f} | {_rms(_joined(of, 'velocity error [m/s]')):.3f} |"
                f" {np.mean(_joined(of, 'NEES')):.2f} |"
            )
    total = sum(row["duration [s]"] for row in rows)
    gone = [row["gone after [s]"] for row in rows if row["count"] and row["gone after [s]"] is not None]
    of_those = sum(row["count"] > 0 for row in rows)
    return [
        *lines,
        "",
        f"- false opponents: {sum(row['false track [s]'] for row in rows):.1f} s of {total:.0f} s",
        f"- one taken off the field is forgotten after {np.median(gone) if gone else math.nan:.1f} s (median of"
        f" {len(gone)} of {of_those}; the head comes by every other second)",
        "",
    ]


def _joined(rows: Sequence[Row], name: str) -> np.ndarray:
    return np.array([value for row in rows for value in row[name]], dtype=np.float64)


def _rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2))) if len(values) else math.nan


def _consistency(nees: np.ndarray, bound: float) -> str:
    if not len(nees):
        return "no looks"
    inside = 100.0 * np.mean(nees < bound)
    return f"NEES below its 95 % bound in {inside:.1f} % of {len(nees)} looks, mean {nees.mean():.2f}"


TRIALS: list[tuple[object, ...]] = [
    *(("standing", d, walks, seed) for d in RANGES for walks in (False, True) for seed in range(STANDING_SEEDS)),
    *(("rolling", v, walks, seed) for v in SPEEDS for walks in (False, True) for seed in range(ROLLING_SEEDS)),
    *(
        ("hidden", rolls, walks, seed)
        for rolls in (False, True)
        for walks in (False, True)
        for seed in range(HIDDEN_SEEDS)
    ),
    *(
        ("opponents", count, walk, own, seed)
        for count in (0, 1, 2, 3)
        for walk in (False, True)
        for own in (False, True)
        for seed in range(OPPONENT_SEEDS)
    ),
]
BENCH = Bench("ball", "Ball and opponents", TRIALS, measure, summarize, draw)
