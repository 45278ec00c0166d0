"""Diagrams of the page: curves of the last seconds."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import viser
from viser import uplot

from tulip_view.live.inputs import WINDOW
from tulip_view.live.shapes import Array

HEIGHT = 190  # [px]


class Plot:
    """Lines over time."""

    def __init__(self, server: viser.ViserServer, title: str, lines: Sequence[tuple[str, str]]) -> None:
        """Add an empty diagram.

        Args:
            server: Of the page.
            title: With the unit.
            lines: Name and colour of each line.
        """
        self._server, self._lines = server, lines
        self._known = tuple(True for _ in lines)
        empty = (np.array([0.0, WINDOW]), *(np.zeros(2) for _ in lines))
        scales = {"x": uplot.Scale(time=False)}
        self._handle = server.gui.add_uplot(empty, self._series(), title=title, scales=scales, height=HEIGHT)

    def draw(self, times: Array, lines: Sequence[Array]) -> None:
        """Draw curves.

        Args:
            times: (n,) [s].
            lines: (n,) of each line; one that is NaN throughout is left out.
        """
        if len(times) < 2:
            times, lines = np.array([0.0, WINDOW]), [np.zeros(2) for _ in self._lines]
        known = tuple(not bool(np.isnan(line).all()) for line in lines)
        data = (times, *(_without_gaps(times, line) for line in lines))
        with self._server.atomic():
            if known != self._known:
                self._known = known
                self._handle.series = self._series()
            if not all(np.array_equal(new, before) for new, before in zip(data, self._handle.data, strict=True)):
                self._handle.data = data

    def _series(self) -> tuple[uplot.Series, ...]:
        styles = zip(self._lines, self._known, strict=True)
        return (
            uplot.Series(label="s"),
            *(uplot.Series(label=name, stroke=colour, width=1.5, show=known) for (name, colour), known in styles),
        )


def _without_gaps(times: Array, line: Array) -> Array:
    """Return a line with numbers where it is NaN, from which the browser's library could make no scale."""
    good = np.isfinite(line)
    return np.interp(times, times[good], line[good]) if good.any() else np.zeros(len(line))
