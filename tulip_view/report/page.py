"""The report as one HTML file that needs nothing else."""

from __future__ import annotations

import base64
import html
import json
from importlib import resources
from typing import Any

import numpy as np
from numpy.typing import NDArray
from plotly.offline import get_plotlyjs

from tulip_view.report.build import Report
from tulip_view.report.figures import Band, Figure, Line, Mark, Section, Span, ink_on

HELP = (
    "One time runs through the page: the slider of the replay, a click into a diagram of time, on a picture or on an "
    "event sets it; the vertical line shows it. Drag over a diagram to zoom, in time in all of them; a double click "
    "shows all again; a click on a name in a legend hides its line."
)
LETTER = 0.0078  # of the timeline's width that one letter takes
LEAST_LETTERS = 6  # fewer do not tell a name


def make_page(report: Report) -> str:
    """Return the page."""
    files = resources.files("tulip_view.report")
    style, script = (files.joinpath(f"page.{ending}").read_text(encoding="utf-8") for ending in ("css", "js"))
    figures = {figure.key: draw(figure) for section in report.sections for figure in section.figures}
    replay = next((section.replay for section in report.sections if section.replay is not None), None)
    links = "".join(f'<a href="#{each.key}">{html.escape(each.title)}</a>' for each in report.sections)
    body = "".join(_section(section) for section in report.sections)
    title = html.escape(report.title)
    content = json.dumps({"figures": figures, "replay": _packed(replay)}, allow_nan=False).replace("<", "\\u003c")
    return (
        f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><title>{title}</title>\n'
        f'<meta name="viewport" content="width=device-width">\n<style>\n{style}</style></head>\n<body>'
        f"<header><h1>{title}</h1><nav>{links}</nav></header>\n<main><p>{HELP}</p>{body}</main>\n"
        f"<script>{get_plotlyjs()}</script>\n"
        f'<script id="content" type="application/json">{content}</script>\n<script>\n{script}</script></body></html>\n'
    )


def draw(figure: Figure) -> dict[str, Any]:
    """Return a figure as plotly takes it, with what `page.js` needs to know besides."""
    traces: list[dict[str, Any]] = []
    for item in figure.items:
        if isinstance(item, Line):
            traces.append(_line(item, figure))
            if item.points and item.name:  # points as small as those of the diagram could not be seen in the legend
                traces.append(_sample(traces[-1]))
        elif isinstance(item, Band):
            traces += _band(item, figure)
    traces += _lanes(figure)
    layout: dict[str, Any] = {
        "height": figure.height,
        "margin": {"l": 64, "r": 16, "t": 28, "b": 44},
        "xaxis": {"title": {"text": figure.x_label}, "zeroline": False, "gridcolor": "#e6e9ee"},
        "yaxis": {"title": {"text": figure.y_label}, "zeroline": False, "gridcolor": "#e6e9ee", "automargin": True},
        "legend": {
            "orientation": "h",
            "y": 1.0,
            "yanchor": "bottom",
            "x": 0.0,
            "traceorder": "normal",
        },
        "hovermode": "closest",
        "plot_bgcolor": "#ffffff",
        "paper_bgcolor": "#ffffff",
        "font": {"family": "system-ui, sans-serif", "size": 12, "color": "#26313d"},
    }
    if figure.x_range is not None:
        layout["xaxis"]["range"] = list(figure.x_range)
    if figure.y_range is not None:
        layout["yaxis"]["range"] = list(figure.y_range)
    if figure.equal:
        layout["yaxis"]["scaleanchor"] = "x"
        layout["xaxis"]["constrain"] = layout["yaxis"]["constrain"] = "domain"
    if any(isinstance(item, Span | Mark) for item in figure.items):
        lanes = list(dict.fromkeys(item.lane for item in figure.items if isinstance(item, Span | Mark)))
        layout["yaxis"].update(type="category", categoryorder="array", categoryarray=lanes[::-1])
        layout["barmode"] = "overlay"
        layout["uniformtext"] = {"mode": "hide", "minsize": 11}  # of a narrow page
        layout["margin"]["l"] = 72
    return {"traces": traces, "layout": layout, "time": figure.time, "choices": list(figure.choices)}


def _line(line: Line, figure: Figure) -> dict[str, Any]:
    trace: dict[str, Any] = {
        "type": "scatter",
        "mode": "markers" if line.points else "lines",
        "name": line.name,
        "showlegend": bool(line.name),
        "hoverinfo": "skip" if not line.name else "x+y+name",
        "y": packed(line.y),
        "x": packed(line.x),
    }
    if line.points:
        trace["marker"] = {"color": line.colour, "size": line.width, "opacity": 0.6}
    else:
        trace["line"] = {"color": line.colour, "width": line.width, "dash": "dash" if line.dashed else "solid"}
    if line.closed:
        trace["fill"] = "toself"
        trace["fillcolor"] = line.colour if not line.name and figure.key == "field" else "rgba(120,130,140,0.15)"
    return _with_choice(trace, line.choice, figure)


def _sample(points: dict[str, Any]) -> dict[str, Any]:
    """Move the entry in the legend from points to a larger one that is nowhere in the diagram; return that."""
    points.update(showlegend=False, legendgroup=points["name"])
    return {**points, "x": [None], "y": [None], "showlegend": True, "marker": {**points["marker"], "size": 8}}


def _band(band: Band, figure: Figure) -> list[dict[str, Any]]:
    """Return one outline for each piece without gaps: plotly would fill the space between pieces, too."""
    known = np.isfinite(band.x) & np.isfinite(band.low) & np.isfinite(band.high)
    gap = np.array([np.nan])
    x: list[NDArray[Any]] = []
    y: list[NDArray[Any]] = []
    for piece in np.split(np.arange(len(known)), np.flatnonzero(np.diff(known)) + 1):
        if len(piece) and known[piece[0]]:
            x += [band.x[piece], band.x[piece][::-1], gap]
            y += [band.low[piece], band.high[piece][::-1], gap]
    if not x:
        return []
    trace = {
        "type": "scatter",
        "mode": "lines",
        "line": {"width": 0},
        "hoverinfo": "skip",
        "name": band.name,
        "fill": "toself",
        "fillcolor": band.colour + "44",
        "x": packed(np.concatenate(x)),
        "y": packed(np.concatenate(y)),
    }
    return [_with_choice(trace, band.choice, figure)]


def _lanes(figure: Figure) -> list[dict[str, Any]]:
    spans = [item for item in figure.items if isinstance(item, Span)]
    marks = [item for item in figure.items if isinstance(item, Mark)]
    traces: list[dict[str, Any]] = []
    if spans:
        whole = max(span.end for span in spans) - min(span.begin for span in spans)
        traces.append(
            {
                "type": "bar",
                "orientation": "h",
                "y": [span.lane for span in spans],
                "base": [span.begin for span in spans],
                "x": [span.end - span.begin for span in spans],
                "marker": {"color": [span.colour for span in spans], "line": {"width": 0.5, "color": "#ffffff"}},
                "text": [fitting(span.label, (span.end - span.begin) / whole) for span in spans],
                "textposition": "inside",
                "insidetextanchor": "middle",
                "textangle": 0,
                "textfont": {"color": [ink_on(span.colour) for span in spans], "size": 11},
                "showlegend": False,
                "customdata": [f"{s.label}<br>{s.begin:.2f} s to {s.end:.2f} s" for s in spans],
                "hovertemplate": "%{customdata}<extra></extra>",
                "width": 0.7,
            }
        )
    for kind in dict.fromkeys(mark.kind for mark in marks):
        same = [mark for mark in marks if mark.kind == kind]
        traces.append(
            {
                "type": "scatter",
                "mode": "markers",
                "name": kind,
                "showlegend": True,
                "x": [mark.time for mark in same],
                "y": [mark.lane for mark in same],
                "marker": {
                    "color": same[0].colour,
                    "size": 11,
                    "symbol": same[0].symbol,
                    "line": {"width": 1, "color": "#ffffff"},
                },
                "customdata": [f"{html.escape(mark.label)}<br>{mark.time:.2f} s" for mark in same],
                "hovertemplate": "%{customdata}<extra></extra>",
            }
        )
    return traces


def fitting(label: str, share: float) -> str:
    """Return as much of a name as fits into a bar that takes a share of the width; the mouse tells the rest."""
    room = int(share / LETTER)
    if len(label) <= room:
        return label
    return label[: room - 1].rstrip() + "…" if room >= LEAST_LETTERS else ""


def _with_choice(trace: dict[str, Any], choice: str, figure: Figure) -> dict[str, Any]:
    if choice:
        trace["meta"] = choice
        trace["visible"] = choice == figure.choices[0]
    return trace


def packed(values: Any) -> dict[str, str]:
    """Return an array as plotly reads it: little-endian single floats in base64."""
    array = np.ascontiguousarray(values, dtype="<f4")
    return {"dtype": "f4", "bdata": base64.b64encode(array.tobytes()).decode()}


def _packed(replay: dict[str, Any] | None) -> dict[str, Any] | None:
    if replay is None:
        return None
    found: dict[str, Any] = {}
    for name, value in replay.items():
        if isinstance(value, np.ndarray):
            found[name] = packed(value)["bdata"]
        elif name == "ground":
            found[name] = [{**line, "x": packed(line["x"])["bdata"], "y": packed(line["y"])["bdata"]} for line in value]
        else:
            found[name] = value
    return found


def _section(section: Section) -> str:
    parts = [f'<section id="{section.key}"><h2>{html.escape(section.title)}</h2>']
    parts += [f"<p>{html.escape(words)}</p>" for words in section.words]
    if section.facts:
        pairs = (f"<div><dt>{html.escape(name)}</dt><dd>{html.escape(fact)}</dd></div>" for name, fact in section.facts)
        parts.append(f"<dl>{''.join(pairs)}</dl>")
    if section.replay is not None:
        parts.append(
            "<p>Turn with the mouse, move with the right button, zoom with the wheel.</p>"
            '<div id="stage"></div><div class="controls"><button id="play">Play</button>'
            '<input id="slider" type="range" min="0" value="0" step="1" aria-label="time">'
            '<output id="now"></output><select id="speed" aria-label="speed"><option value="0.25">0.25 x</option>'
            '<option value="0.5">0.5 x</option><option value="1" selected>1 x</option><option value="2">2 x</option>'
            '<option value="4">4 x</option></select>'
            '<label><input type="checkbox" id="follow" checked> follow the robot</label></div>'
        )
    choices = next((figure.choices for figure in section.figures if figure.choices), ())
    if choices:
        options = "".join(f"<option>{html.escape(choice)}</option>" for choice in choices)
        parts.append(
            f'<p><label>Joint <select class="choice" data-section="{section.key}">{options}</select></label></p>'
        )
    parts.append('<div class="figures">')
    for figure in section.figures:
        kind = "figure half" if figure.half else "figure"
        parts.append(
            f'<div class="{kind}"><h3>{html.escape(figure.title)}</h3>'
            f'<div class="plot" id="figure-{figure.key}" style="height:{figure.height}px"></div></div>'
        )
    parts.append("</div>")
    if section.rows:
        head = "".join(f"<th>{html.escape(cell)}</th>" for cell in section.header)
        times = [f' data-time="{time:.4f}"' for time in section.row_times] or [""] * len(section.rows)
        rows = "".join(
            f"<tr{time}>" + "".join(f"<td>{html.escape(cell)}</td>" for cell in row) + "</tr>"
            for time, row in zip(times, section.rows, strict=True)
        )
        parts.append(f'<div class="table"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>')
    if section.stills:
        parts.append('<div class="stills">')
        for still in section.stills:
            data = base64.b64encode(still.jpeg).decode()
            parts.append(
                f'<figure data-time="{still.time:.4f}"><img alt="camera picture at {still.time:.2f} s" '
                f'src="data:image/jpeg;base64,{data}"><figcaption>{html.escape(still.caption)}</figcaption></figure>'
            )
        parts.append("</div>")
    parts.append("</section>\n")
    return "".join(parts)
