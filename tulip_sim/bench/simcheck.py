"""The simulator validated: its own balances, and Pinocchio's dynamics beside it, from a swinging leg to a landing."""

from __future__ import annotations

from tulip_sim.bench.runner import Bench, Row
from tulip_sim.bench.simcheck_picture import curves, draw
from tulip_sim.simcheck.study import STUDIES

SUBSTEPS = (1, 2, 4)  # steps of physics a millisecond; the simulator plays with one


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
    first = next(iter(references))
    differences = [
        {"beside": each, "what": found[0].what, "unit": found[0].unit}
        | {"asked": found[0].asked if each == first else None}
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
    return [
        "The simulated robot without randomness (no joint friction, no sensor errors). What is done, where the bounds"
        " come from and why the engines part: [simcheck.md](simcheck.md).",
        "",
        *_balances(rows),
        "",
        *_differences(rows),
    ]


def _balances(rows: list[Row]) -> list[str]:
    names = {each["what"]: each["unit"] for row in rows for each in row["balances"]}
    lines = [
        "Balances of the simulator at its step of 1 ms, computed with Pinocchio from the states and ground forces that"
        " pybullet gives: the greatest error during the run, and its bound.",
        "",
        f"| experiment | {' | '.join(f'{name} [{unit}]' for name, unit in names.items())} | verdict |",
        "| --- |" + " --- |" * (len(names) + 1),
    ]
    broken = 0
    for row in rows:
        found = {each["what"]: (each["values"][0], each["bounds"][0]) for each in row["balances"]}
        cells = [f"{found[name][0]:.2g} of {found[name][1]:.2g}" if name in found else "" for name in names]
        over = [name for name, (value, bound) in found.items() if value > bound]
        broken += len(over)
        lines.append(f"| {row['experiment']} | {' | '.join(cells)} | {_verdict('beyond', over)} |")
    count = sum(len(row["balances"]) for row in rows)
    return [*lines, "", f"- {count - broken} of {count} balances are within their bounds"]


def _differences(rows: list[Row]) -> list[str]:
    every = [each for row in rows for each in row["differences"]]
    names = {each["what"]: each["unit"] for each in every}
    asked = {each["what"]: each["asked"] for each in every if each["asked"] is not None}
    heads = [f"{name} [{unit}]" + (f", {asked[name]:g} asked" if name in asked else "") for name, unit in names.items()]
    lines = [
        "Greatest difference between the simulator and Pinocchio during the run, with steps of 1, 0.5 and 0.25 ms. What"
        " is asked is asked at 1 ms, and of the first line of an experiment.",
        "",
        f"| experiment | beside | {' | '.join(heads)} | verdict |",
        "| --- | --- |" + " --- |" * (len(names) + 1),
    ]
    for row in rows:
        for beside in dict.fromkeys(each["beside"] for each in row["differences"]):
            own = {each["what"]: each for each in row["differences"] if each["beside"] == beside}
            cells = [
                ", ".join(f"{value:.2g}" for value in own[name]["values"]) if name in own else "" for name in names
            ]
            bounds = {name: each["asked"] for name, each in own.items() if each["asked"] is not None}
            over = [name for name, bound in bounds.items() if own[name]["values"][0] > bound]
            verdict = _verdict("parts", over) if bounds else ""
            lines.append(f"| {row['experiment']} | {beside} | {' | '.join(cells)} | {verdict} |")
    return lines


def _verdict(word: str, names: list[str]) -> str:
    return f"{word}: {', '.join(names)}" if names else "within"


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
