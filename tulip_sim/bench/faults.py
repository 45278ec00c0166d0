"""Every fault of the table happens while the robot walks: what does it do? And each node is killed, again and again.

A row of the table is compared with what is stated there. A node that was killed has to be back in the graph soon; the
robot has to stay upright, or lie with legs that only damp until people have set it up; and it has to play on.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tulip_sim.bench.free_port import own_domain
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.fault_table import ROWS
from tulip_sim.fault_trial import plan_of, running
from tulip_sim.match_graph import NODES

ROUNDS = 20
KILLED = ("driver", *NODES)
SOON = 2.0  # [s] of wall-clock time, asked for in the median
FROM_OUTSIDE = "from outside"
"""Name of the rows that share a graph."""
Trial = tuple[str, str]


def trials(rounds: int = ROUNDS, only: str = "") -> list[Trial]:
    """Return what to run: rows of the table by name, and rounds in which each node is killed once.

    Args:
        rounds: How many.
        only: Part of the rows' and nodes' names that are wanted, as a regular expression; "" for all.
    """
    rows = [row for row in ROWS if re.search(only, row.name)]
    found: list[Trial] = [("row", row.name) for row in rows if not row.at_any_time]
    if any(row.at_any_time for row in rows):
        found.append((FROM_OUTSIDE, only))
    if any(re.search(only, f"{node} killed") for node in KILLED):
        found += [(f"kills {number}", only) for number in range(1, rounds + 1)]
    return found


def choose(options: Mapping[str, str]) -> list[Trial]:
    """Return fewer trials, by options `rounds` and `only`.

    Raises:
        ValueError: if an option is unknown or cannot be used.
    """
    unknown = set(options) - {"rounds", "only"}
    if unknown:
        raise ValueError(f"there is no {', '.join(sorted(unknown))}; expected rounds or only")
    rounds, only = options.get("rounds", str(ROUNDS)), options.get("only", "")
    if not rounds.isdigit():
        raise ValueError(f"rounds is {rounds!r}; expected a number >= 0")
    try:
        found = trials(int(rounds), only)
    except re.error as error:
        raise ValueError(f"only is {only!r}, no regular expression: {error}") from error
    if not found:
        raise ValueError(f"only is {only!r}; expected part of a name as in {ROWS[0].name!r} or 'vision killed'")
    return found


def measure(kind: str, argument: str) -> Row:
    """Run one trial, see `trials`."""
    own_domain()
    with tempfile.TemporaryDirectory(prefix="tulip_faults_") as folder:
        logs = Path(folder)
        if kind == "row":
            row = next(each for each in ROWS if each.name == argument)
            with running(plan_of(row, 1, logs), logs) as trial:
                return {"part": kind, "rows": [trial.react(row)]}
        if kind == FROM_OUTSIDE:
            rows = [row for row in ROWS if row.at_any_time and re.search(argument, row.name)]
            with running(plan_of(None, 1, logs), logs, hung=0.0) as trial:
                return {"part": kind, "rows": [trial.react(row) for row in rows]}
        number = int(kind.rpartition(" ")[2])
        rng = np.random.default_rng(number)
        nodes = [str(node) for node in rng.permutation(KILLED) if re.search(argument, f"{node} killed")]
        with running(plan_of(None, number, logs), logs) as trial:
            return {"part": kind, "kills": [trial.kill(node, float(rng.uniform(0.5, 3.0))) for node in nodes]}


def summarize(rows: list[Row]) -> list[str]:
    """Return both tables."""
    return [*_killed([kill for row in rows for kill in row.get("kills", ())]), *_table(rows)]


def _killed(kills: Sequence[dict[str, Any]]) -> list[str]:
    if not kills:
        return []
    lines = [
        "Each node is killed (SIGKILL) at random moments while the robot walks, in trials with camera. `back` is the"
        f" time until the new node is in the graph, wall clock; asked for: {SOON:g} s in the median. `safe`: upright,"
        " or on the ground until people set it up, with legs that only damp; asked for: always. `plays on`: walks"
        " again in the same trial, in simulated time after the kill, or in the next if a goal ended this one; after the"
        " driver's death in a new one, since the simulated world died with it.",
        "",
        "| node | killed | back [s], median (greatest) | safe | of these upright | plays on"
        " | after [s], median (greatest) |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for node in (*KILLED, "all"):
        own = [kill for kill in kills if node in (kill["node"], "all")]
        if own:
            counts = [sum(bool(kill[name]) for kill in own) for name in ("safe", "upright", "plays on")]
            back, again = (_spread([kill[name] for kill in own if kill[name] is not None]) for name in TIMES)
            cells = (node, len(own), back, *counts, again)
            lines.append(f"| {' | '.join(map(str, cells))} |")
    return [*lines, ""]


TIMES = ("back [s]", "plays on after [s]")


def _spread(values: Sequence[float]) -> str:
    return f"{np.median(values):.2f} ({max(values):.2f})" if values else "-"


def _table(rows: Sequence[Row]) -> list[str]:
    found = [each for row in rows for each in row.get("rows", ())]
    if not found:
        return []
    right = sum(each["stated"] == each["observed"] and each["told"] for each in found)
    lines = [
        "Every row of the table in [safety.md](safety.md), made to happen while the robot walks:"
        f" {right} of {len(found)} as stated. `told`: the diagnostics say what the table says that they do.",
        "",
        "| fault | stated | observed | told | fell | watched, simulated [s] | wall clock [s] |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for each in found:
        cells = [str(value) for value in each.values()]
        cells[3], cells[4] = ("yes" if each[name] else "no" for name in ("told", "fell"))
        lines.append(f"| {' | '.join(cells)} |")
    return lines


BENCH = Bench("faults", "Faults", trials(), measure, summarize, workers=1, choose=choose)
