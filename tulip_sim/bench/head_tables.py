"""Tables of the bench of the head."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from tulip_sim.bench.head_trials import GAZES, NEAR, SHARE_DURATION, SPEEDS, SURE
from tulip_sim.bench.runner import Row


def summarize(rows: list[Row]) -> list[str]:
    """Return the tables."""
    lines = [
        "World model, gaze planner, strategy's search and head movement as they play, in the timing of lockstep."
        " Simulated without dynamics or pictures: the body slides as told with dead reckoning that errs by some"
        " percent, and what vision would find comes from the truth through the real lens, with noise, misses (also of"
        " a fast head), a camera whose pose errs as vision says, and 48 ms of delay.",
        "",
        *_coverage_lines([row for row in rows if row["what"] == "coverage"]),
        *_share_lines([row for row in rows if row["what"] == "share"]),
        *_search_lines([row for row in rows if row["what"] == "search"]),
        *_roll_lines([row for row in rows if row["what"] == "roll"]),
    ]
    return lines


def _coverage_lines(rows: Sequence[Row]) -> list[str]:
    return [
        f"- search, body {row['body']}, {row['duration [s]']} s: {row['seen [%]']} % of the ground from 0.25 m to the"
        f" field's diagonal seen (a ball of at least 4 px in 3 sharp pictures), complete within"
        f" {row['complete up to [deg]']:.0f} deg to both sides"
        for row in rows
    ] + [""]


def _share_lines(rows: Sequence[Row]) -> list[str]:
    names = (
        "position RMSE [m]", "heading RMSE [deg]", "position deviation [m]", "heading deviation [deg]", "NEES",
        "ball error, median [%]", "ball error, 95 % [%]", "ball in picture [%]", "near ball in picture [%]",
    )  # fmt: skip
    lines = [
        f"A ball followed for {SHARE_DURATION:.0f} s and kicked on again and again; started with up to 0.3 m and 10 deg"
        f" of error, judged after 5 s. Ball error in per cent of its range; near is nearer than {NEAR} m. Means of"
        f" {len({row['seed'] for row in rows})} trials.",
        "",
        "| gaze | " + " | ".join(names) + " |",
        "| --- |" + " --- |" * len(names),
    ]
    for gaze in GAZES:
        of = [row for row in rows if row["gaze"] == gaze]
        if of:
            lines.append(
                f"| {gaze} | " + " | ".join(f"{np.nanmean([row[name] for row in of]):.3g}" for name in names) + " |"
            )
    lines += [
        "",
        "Share of the time in which the gaze is beside the ball or at landmarks, by how sure the pose is:",
        "",
        "| gaze | " + " | ".join(_class_names()) + " |",
        "| --- |" + " --- |" * (len(SURE) + 1),
    ]
    for gaze in GAZES:
        shares = _shares([row for row in rows if row["gaze"] == gaze])
        if shares:
            lines.append(f"| {gaze} | " + " | ".join(shares) + " |")
    return [*lines, ""]


def _class_names() -> list[str]:
    edges = [f"{edge:g} m" for edge in SURE]
    return [f"< {edges[0]}", *(f"{a} to {b}" for a, b in pairwise(edges)), f"> {edges[-1]}"]


def _shares(rows: Sequence[Row]) -> list[str]:
    if not rows:
        return []
    all_pictures = np.sum([row["pictures by deviation"] for row in rows], axis=0)
    beside = np.sum([row["beside the ball"] for row in rows], axis=0)
    return [
        f"{100.0 * part / whole:.0f} % of {whole}" if whole else "-"
        for part, whole in zip(beside, all_pictures, strict=True)
    ]


def _search_lines(rows: Sequence[Row]) -> list[str]:
    if not rows:
        return []
    times = np.array([row["found after [s]"] for row in rows])
    found = times[~np.isnan(times)]
    lines = [f"- search for a ball anywhere on the field: found {len(found)} of {len(rows)}"]
    if len(found):
        lines[0] += (
            f"; median {np.median(found):.1f} s, 90 % {np.percentile(found, 90):.1f} s, most {found.max():.1f} s"
        )
    return [*lines, ""]


def _roll_lines(rows: Sequence[Row]) -> list[str]:
    lines = [
        "A resting ball is kicked and rolls by at 0.7 to 1.8 m in front of the standing robot:",
        "",
        "| gaze | " + " | ".join(f"{speed:g} m/s" for speed in SPEEDS) + " |",
        "| --- |" + " --- |" * len(SPEEDS),
    ]
    for gaze in GAZES:
        cells = []
        for speed in SPEEDS:
            of = [row for row in rows if row["gaze"] == gaze and row["speed [m/s]"] == speed]
            cells.append(
                f"{np.mean([row['ball in picture [%]'] for row in of]):.0f} %, off axis"
                f" {np.median([row['off axis, median [deg]'] for row in of]):.1f} deg"
                if of
                else "-"
            )
        if any(cell != "-" for cell in cells):
            lines.append(f"| {gaze} | " + " | ".join(cells) + " |")
    return lines
