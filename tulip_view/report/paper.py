"""The report on paper: the same figures as a PDF, or as one PNG each."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import cv2
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.backends.backend_pdf import PdfPages
from matplotlib.figure import Figure as Canvas
from matplotlib.layout_engine import ConstrainedLayoutEngine
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from tulip_view.report.build import Report
from tulip_view.report.figures import SYMBOLS, Band, Figure, Line, Mark, Section, Span, ink_on

PAGE = (11.69, 8.27)  # [in] A4 across
DPI = 110
ROWS = 34  # lines of a table on one page
WRAP = 150  # letters of a line of words
HEADING = 0.95  # of the page's height, below the title
LINE = 0.02  # of the page's height, that a line of words takes
THIN = 0.6  # lines on paper are thinner than on a screen
FACES = ((0, 1, 3, 2), (4, 5, 7, 6), (0, 1, 5, 4), (2, 3, 7, 6), (0, 2, 6, 4), (1, 3, 7, 5))
SNAPSHOTS = 6
LETTER = 0.0062  # of the timeline's width that one letter takes
Named = tuple[str, Canvas]


def write_pdf(report: Report, path: Path) -> None:
    """Write all sections into a PDF.

    Raises:
        OSError: if it cannot be written.
    """
    with PdfPages(path, metadata={"Title": report.title}) as pdf:
        for _, canvas in canvases(report):
            pdf.savefig(canvas)


def write_pngs(report: Report, folder: Path) -> list[Path]:
    """Write each figure into a PNG file, named by section and figure; return the files.

    Raises:
        OSError: if one cannot be written.
    """
    with TemporaryDirectory(dir=folder, prefix=".part") as part:  # all or none come to stay
        for name, canvas in canvases(report):
            FigureCanvasAgg(canvas)
            canvas.savefig(Path(part) / f"{name}.png", dpi=DPI)
        return [path.replace(folder / path.name) for path in sorted(Path(part).iterdir())]


def canvases(report: Report) -> Iterator[Named]:
    """Yield the pages with their names, one after the other: a page of many points takes much memory."""
    for number, section in enumerate(report.sections, 1):
        prefix = f"{number:02}_{section.key}"
        title = f"{report.title}: {section.title}"
        lines = [line for paragraph in section.words for line in textwrap.wrap(paragraph, WRAP)]
        lines += ["; ".join(f"{name}: {fact}" for name, fact in section.facts)] if section.facts else []
        for name, canvas in _of_section(section, prefix, title):
            _caption(canvas, lines)
            lines = []  # on the first page alone
            yield name, canvas
        if lines:
            _caption(canvas := _canvas(title), lines)
            yield f"{prefix}_words", canvas


def _of_section(section: Section, prefix: str, title: str) -> Iterator[Named]:
    """Yield the pages of one section."""
    waiting: list[Figure] = []
    for figure in section.figures:
        if figure.choices:
            yield f"{prefix}_{figure.key}", _all_choices(figure, title)
        elif figure.equal and not figure.half:
            yield f"{prefix}_{figure.key}", _page([figure], title, 1)
        else:
            waiting.append(figure)
    for group, columns in _groups(waiting):
        yield f"{prefix}_{group[0].key}", _page(group, title, columns)
    if section.replay is not None:
        yield f"{prefix}_snapshots", _snapshots(section.replay, title)
    if section.stills:
        yield f"{prefix}_pictures", _stills(section, title)
    for page, canvas in enumerate(_table(section, title), 1):
        yield f"{prefix}_table{page}", canvas


def _groups(figures: list[Figure]) -> Iterator[tuple[list[Figure], int]]:
    """Yield figures that share a page, and in how many columns: half ones side by side, others up to three in one."""
    whole = [figure for figure in figures if not figure.half]
    for begin in range(0, len(whole), 3):
        yield whole[begin : begin + 3], 1
    half = [figure for figure in figures if figure.half]
    for begin in range(0, len(half), 2):
        yield half[begin : begin + 2], 2


def _canvas(title: str) -> Canvas:
    canvas = Canvas(figsize=PAGE, layout=ConstrainedLayoutEngine(rect=(0.0, 0.0, 1.0, HEADING)))
    canvas.text(0.01, 0.985, title, fontsize=12, fontweight="bold", va="top")
    return canvas


def _caption(canvas: Canvas, lines: list[str]) -> None:
    """Write lines below a page's title, and move what it shows down."""
    for number, line in enumerate(lines):
        canvas.text(0.01, HEADING - LINE * number, line, fontsize=8, va="top")
    room = HEADING - LINE * len(lines) - (0.01 if lines else 0.0)
    canvas.set_layout_engine(ConstrainedLayoutEngine(rect=(0.0, 0.0, 1.0, room)))


def _page(figures: list[Figure], title: str, columns: int) -> Canvas:
    canvas = _canvas(title)
    rows = math.ceil(len(figures) / columns)
    for axes, figure in zip(canvas.subplots(rows, columns, squeeze=False).flat, figures, strict=False):
        _draw(axes, figure)
        axes.set_title(figure.title, fontsize=10, loc="left")
    return canvas


def _all_choices(figure: Figure, title: str) -> Canvas:
    canvas = _canvas(f"{title}: {figure.title}")
    columns = 3
    rows = math.ceil(len(figure.choices) / columns)
    grid = canvas.subplots(rows, columns, squeeze=False, sharex=True)
    for axes, choice in zip(grid.flat, figure.choices, strict=False):
        _draw(axes, figure, choice, legend=choice == figure.choices[0])
        axes.set_title(choice, fontsize=8, loc="left", pad=2)
        axes.tick_params(labelsize=7)
        if axes not in grid[-1]:
            axes.set_xlabel("")
        axes.set_ylabel(figure.y_label if axes in grid[:, 0] else "", fontsize=7)
    return canvas


def _draw(axes: Axes, figure: Figure, choice: str = "", legend: bool = True) -> None:
    for item in figure.items:
        if isinstance(item, Line) and item.choice in ("", choice):
            _draw_line(axes, item, figure)
        elif isinstance(item, Band) and item.choice in ("", choice):
            axes.fill_between(item.x, item.low, item.high, color=item.colour, alpha=0.28, lw=0, label=item.name)
    _draw_lanes(axes, figure)
    axes.set_xlabel(figure.x_label, fontsize=8)
    axes.set_ylabel(figure.y_label, fontsize=8)
    axes.tick_params(labelsize=8)
    axes.grid(color="#e6e9ee", lw=0.5)
    axes.set_axisbelow(True)
    if figure.x_range is not None:
        axes.set_xlim(*figure.x_range)
    if figure.y_range is not None:
        axes.set_ylim(*figure.y_range)
    if figure.equal:
        axes.set_aspect("equal", adjustable="box")
    if legend and axes.get_legend_handles_labels()[1]:
        below = figure.equal and not figure.half
        axes.legend(
            fontsize=7,
            ncols=4 if below else 5,
            loc="upper center" if below else "upper right",
            bbox_to_anchor=(0.5, -0.08) if below else None,
            framealpha=0.7,
        )


def _draw_line(axes: Axes, line: Line, figure: Figure) -> None:
    label = line.name or "_"
    if line.points:
        axes.plot(line.x, line.y, ".", color=line.colour, ms=line.width, alpha=0.6, label=label)
        return
    if line.closed:
        opaque = figure.key == "field" and not line.name
        axes.fill(line.x, line.y, color=line.colour if opaque else "#8a949e", alpha=1.0 if opaque else 0.15, lw=0)
    axes.plot(line.x, line.y, "--" if line.dashed else "-", color=line.colour, lw=line.width * THIN, label=label)


def _draw_lanes(axes: Axes, figure: Figure) -> None:
    timed = [item for item in figure.items if isinstance(item, Span | Mark)]
    if not timed:
        return
    lanes = list(dict.fromkeys(item.lane for item in timed))[::-1]
    handles: dict[str, Artist] = {}
    spans = [item for item in timed if isinstance(item, Span)]
    whole = max((span.end for span in spans), default=0.0) - min((span.begin for span in spans), default=0.0)
    for item in timed:
        height = lanes.index(item.lane)
        if isinstance(item, Span):
            axes.broken_barh([(item.begin, item.end - item.begin)], (height - 0.35, 0.7), facecolor=item.colour)
            label = f"{item.lane}: {item.label}"
            handles.setdefault(label, Patch(color=item.colour, label=label))
            middle, share = (item.begin + item.end) / 2.0, (item.end - item.begin) / max(whole, 1e-9)
            if len(item.label) * LETTER < share:
                axes.text(middle, height, item.label, fontsize=7, ha="center", va="center", color=ink_on(item.colour))
        else:
            axes.plot(item.time, height, SYMBOLS[item.symbol], color=item.colour, ms=6, mec="white", mew=0.7)
            handles.setdefault(
                item.kind,
                Line2D([], [], marker=SYMBOLS[item.symbol], color=item.colour, ls="", ms=6, label=item.kind),
            )
    axes.set_yticks(range(len(lanes)), lanes)
    axes.legend(
        handles=list(handles.values()),
        fontsize=7,
        ncols=5,
        loc="upper center",
        bbox_to_anchor=(0.5, -0.14),
        frameon=False,
    )


def _stills(section: Section, title: str) -> Canvas:
    canvas = _canvas(title)
    columns = 3
    rows = math.ceil(len(section.stills) / columns)
    for axes in (grid := canvas.subplots(rows, columns, squeeze=False)).flat:
        axes.set_axis_off()
    for axes, still in zip(grid.flat, section.stills, strict=False):
        picture = cv2.imdecode(np.frombuffer(still.jpeg, np.uint8), cv2.IMREAD_COLOR)
        assert picture is not None  # encoded here a moment ago
        axes.imshow(picture[:, :, ::-1])
        axes.set_title(textwrap.fill(still.caption, 52), fontsize=7, loc="left")
    return canvas


def _snapshots(replay: dict[str, Any], title: str) -> Canvas:
    """Draw the robot's boxes at some instants, seen from the front right and above."""
    canvas = _canvas(f"{title}: snapshots")
    known = np.flatnonzero(np.isfinite(replay["links"]).all(axis=(1, 2)))
    if not len(known):
        return canvas
    chosen = known[np.linspace(0, len(known) - 1, SNAPSHOTS).round().astype(int)]
    for number, frame in enumerate(chosen, 1):
        axes: Any = canvas.add_subplot(2, SNAPSHOTS // 2, number, projection="3d", computed_zorder=False)
        _boxes(axes, replay, int(frame))
        middle = replay["links"][frame, 0]
        axes.set(xlim=(middle[0] - 0.6, middle[0] + 0.6), ylim=(middle[1] - 0.6, middle[1] + 0.6), zlim=(0.0, 1.3))
        axes.set_box_aspect((1.2, 1.2, 1.3), zoom=1.15)
        axes.view_init(elev=12, azim=-50)
        axes.tick_params(labelsize=6)
        axes.set_title(f"{replay['times'][frame]:.2f} s", fontsize=8)
    return canvas


def _boxes(axes: Any, replay: dict[str, Any], frame: int) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection
    from scipy.spatial.transform import Rotation

    signs = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    polygons, colours = [], []
    for box in replay["boxes"]:
        place = replay["links"][frame, box["link"]]
        corners = signs * np.array(box["size"]) + np.array(box["centre"])
        corners = Rotation.from_quat(place[3:]).apply(corners) + place[:3]
        polygons += [corners[list(face)] for face in FACES]
        colours += [box["colour"]] * len(FACES)
    axes.add_collection3d(Poly3DCollection(polygons, facecolors=colours, edgecolors="#22222280", linewidths=0.3))


def _table(section: Section, title: str) -> Iterator[Canvas]:
    for begin in range(0, len(section.rows), ROWS):
        rows = section.rows[begin : begin + ROWS]
        canvas = _canvas(title)
        axes = canvas.subplots()
        axes.set_axis_off()
        widths = _widths(section.header, rows)
        shown = [section.header, *rows]
        left = np.concatenate([[0.0], np.cumsum(widths)[:-1]])
        step = min(0.027, 0.98 / (len(shown) + 1))
        for line_number, row in enumerate(shown):
            for x, width, cell in zip(left, widths, row, strict=True):
                text = textwrap.shorten(cell, max(int(width * WRAP * 1.12), 8), placeholder=" ...")
                weight = "bold" if line_number == 0 else "normal"
                y = 0.98 - step * line_number
                axes.text(x, y, text, fontsize=7.5, va="top", fontweight=weight, transform=axes.transAxes)
        yield canvas


def _widths(header: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[float]:
    longest = [min(max(len(row[index]) for row in [header, *rows]) + 3, 110) for index in range(len(header))]
    return [each / max(sum(longest), WRAP) for each in longest]
