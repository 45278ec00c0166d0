"""The simulator validated: its own balances, and Pinocchio's dynamics beside it, from the swing of a leg to a landing."""

from __future__ import annotations

from typing import Any

from tulip_sim.bench.runner import Bench, Row
from tulip_sim.bench.simcheck_picture import curves, draw
from tulip_sim.simcheck.study import STUDIES

SUBSTEPS = (1, 2, 4)  # steps of physics a millisecond; the simulator plays with one
HIDDEN = {"attitude"}  # of the table, for room; in the rows it stands


def measure(name: str) -> Row:
    """Carry out one study with all steps and all references."""
    study = STUDIES[name]()
    runs = {substeps: study.simulate(substeps) for substeps in SUBSTEPS}
    references = {each: study.refer(each) for each in study.references}
    checks = [
        {"what": found[0].what, "unit": found[0].unit}
        | {"values": [_short(each.value) for each in found], "bounds": [_short(each.bound) for each in found]}
        for found in zip(*(study.check(runs[substeps], substeps) for substeps in SUBSTEPS), strict=True)
    ]
    differences = [
        {"beside": each, "what": found[0].what, "unit": found[0].unit, "asked": found[0].asked}
        | {"values": [_short(difference.value) for difference in found]}
        for each, other in references.items()
        for found in zip(*(study.compare(runs[substeps], other) for substeps in SUBSTEPS), strict=True)
    ]
    return {
        "experiment": name,
        "steps [ms]": [1.0 / substeps for substeps in SUBSTEPS],
        "balances": checks,
        "differences": differences,
        "curves": curves(study, name, runs, references),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return a table of balances and one of differences."""
    broken = sum(value > bound for row in rows for *_, value, bound in _first(row))
    names = list(dict.fromkeys(what for row in rows for what, *_ in _first(row)))
    units = {what: unit for row in rows for what, unit, *_ in _first(row)}
    lines = [
        "The simulated robot without randomness (no joint friction, no sensor errors). What is done, where the bounds come"
        " from and why the engines part: [simcheck.md](simcheck.md).",
        "",
        "Balances of the simulator at its step of 1 ms, computed with Pinocchio from the states and ground forces that"
        " pybullet gives: the greatest error during the run, and its bound.",
        "",
        f"| experiment | {' | '.join(f'{name} [{units[name]}]' for name in names)} | verdict |",
        "| --- |" + " --- |" * (len(names) + 1),
    ]
    for row in rows:
        found = {what: (value, bound) for what, _, value, bound in _first(row)}
        cells = [f"{found[name][0]:.2g} of {found[name][1]:.2g}" if name in found else "" for name in names]
        over = [name for name, (value, bound) in found.items() if value > bound]
        verdict = f"beyond: {', '.join(over)}" if over else "within"
        lines.append(f"| {row['experiment']} | {' | '.join(cells)} | {verdict} |")
    within = "all within their bounds" if not broken else f"{broken} beyond their bounds"
    lines += [
        "",
        f"- {sum(len(row['balances']) for row in rows)} balances, {within}",
        "",
        "Greatest difference between the simulator and Pinocchio during the run, with steps of 1, 0.5 and 0.25 ms; in"
        " brackets what is asked at 1 ms.",
        "",
        "| experiment | beside | differences | verdict |",
        "| --- | --- | --- | --- |",
    ]
    for row in rows:
        for beside in dict.fromkeys(each["beside"] for each in row["differences"]):
            own = [each for each in row["differences"] if each["beside"] == beside and each["what"] not in HIDDEN]
            parts = [each["what"] for each in own if each["asked"] is not None and each["values"][0] > each["asked"]]
            cells = [_cell(each) for each in own]
            verdict = f"parts: {', '.join(parts)}" if parts else "within"
            lines.append(f"| {row['experiment']} | {beside} | {'; '.join(cells)} | {verdict} |")
    return lines


def _first(row: Row) -> list[tuple[str, str, float, float]]:
    """Return name, unit, value and bound of each balance at the simulator's own step."""
    return [(each["what"], each["unit"], each["values"][0], each["bounds"][0]) for each in row["balances"]]


def _cell(difference: dict[str, Any]) -> str:
    values = ", ".join(f"{value:.2g}" for value in difference["values"])
    asked = "" if difference["asked"] is None else f" ({difference['asked']:g})"
    return f"{difference['what']} {values} {difference['unit']}{asked}"


def _short(value: float) -> float:
    return float(f"{value:.4g}")


BENCH = Bench(
    "simcheck",
    "The simulator validated",
    [(name,) for name in STUDIES],
    measure,
    summarize,
    draw,
)
