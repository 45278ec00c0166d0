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
        empty = tuple(np.zeros(2) for _ in range(1 + len(lines)))
        styles = [uplot.Series(label=name, stroke=colour, width=1.5) for name, colour in lines]
        self._handle = server.gui.add_uplot(
            empty,
            (uplot.Series(label="s"), *styles),
            title=title,
            scales={"x": uplot.Scale(time=False)},
            height=HEIGHT,
        )

    def draw(self, times: Array, lines: Sequence[Array]) -> None:
        """Draw curves.

        Args:
            times: (n,) [s].
            lines: (n,) of each line; what is NaN is not drawn.
        """
        if len(times) < 2 or all(np.isnan(line).all() for line in lines):  # it must find a scale
            times, lines = np.array([0.0, WINDOW]), [np.zeros(2) for _ in lines]
        data = (times, *lines)
        old = self._handle.data
        if not all(np.array_equal(new, before, equal_nan=True) for new, before in zip(data, old, strict=True)):
            self._handle.data = tuple(np.ascontiguousarray(each, dtype=np.float64) for each in data)
