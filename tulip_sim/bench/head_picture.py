"""Picture of the bench of the head."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from tulip_sim.bench.head_trials import GAZES, SPEEDS, coverage
from tulip_sim.bench.runner import Row
from tulip_strategy.parameters import StrategyParameters


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw the ground that the search sees, and the shares and errors of the gazes."""
    p = StrategyParameters()
    figure = Figure(figsize=(10, 9), layout="constrained")
    pictures = (
        (p.sweep_time, 0.0, f"search, head alone, {p.sweep_time:.0f} s"),
        (2.0 * math.pi / p.search_turn_speed, p.search_turn_speed, "search while the body turns round"),
    )
    for index, (duration, turning, title) in enumerate(pictures):
        axis = figure.add_subplot(2, 2, index + 1, projection="polar")
        result = coverage(duration, turning)
        shown = np.where(result.seen, result.first, np.nan).T
        mesh = axis.pcolormesh(result.directions, result.ranges, shown, cmap="viridis", shading="nearest")
        axis.set_facecolor("tab:red")
        axis.set_theta_zero_location("N")  # type: ignore[attr-defined]  # of polar axes only
        axis.set_rscale("symlog", linthresh=1.0)  # type: ignore[attr-defined]
        axis.set_rticks([0.5, 1.0, 3.0, 10.0])  # type: ignore[attr-defined]
        axis.set_title(f"{title}: seen after [s]; red is never")
        figure.colorbar(mesh, ax=axis, shrink=0.7)
    shares = [row for row in rows if row["what"] == "share"]
    gazes = [gaze for gaze in GAZES if any(row["gaze"] == gaze for row in shares)]
    axis = figure.add_subplot(2, 2, 3)
    for gaze in gazes:
        of = [row for row in shares if row["gaze"] == gaze]
        x = [row["position RMSE [m]"] for row in of]
        axis.scatter(x, [row["ball in picture [%]"] for row in of], label=gaze)
    axis.set(xlabel="position RMSE [m]", ylabel="ball in picture [%]", title="each dot one trial")
    axis.legend()
    axis = figure.add_subplot(2, 2, 4)
    rolls = [row for row in rows if row["what"] == "roll"]
    for gaze in GAZES:
        of = [row for row in rolls if row["gaze"] == gaze]
        means = [
            np.mean([row["ball in picture [%]"] for row in of if row["speed [m/s]"] == speed] or [math.nan])
            for speed in SPEEDS
        ]
        axis.plot(SPEEDS, means, marker="o", label=gaze)
    axis.set(xlabel="speed [m/s]", ylabel="ball in picture [%]", title="ball rolling by", ylim=(0.0, 102.0))
    axis.legend()
    figure.savefig(path, dpi=110)
