"""`bench.py fuzz`: every kind of input from outside, nearly as its reader expects it; docs/security.md."""

from __future__ import annotations

from tulip_sim.bench.runner import Bench, Row
from tulip_view.fuzz.campaign import LONGEST, MEMORY, kind_of, run
from tulip_view.fuzz.inputs import KINDS


def measure(name: str, count: int) -> Row:
    """Read so many inputs of a kind."""
    result = run(kind_of(name), count)
    return {
        "kind": name,
        "inputs": count,
        "accepted": result.accepted,
        "refused": dict(result.refused.most_common()),
        "defects": dict(result.defects.most_common()),
        "examples": [list(each) for each in result.examples],
        "longest [s]": round(result.longest, 4),
        "slowest input": result.slowest,
        "growth of memory [MB]": round(result.memory, 1),
    }


def summarize(rows: list[Row]) -> list[str]:
    """Return a table with a line for each kind."""
    total = sum(row["inputs"] for row in rows)
    defects = sum(sum(row["defects"].values()) for row in rows)
    lines = [
        f"{total} inputs: whole ones that are cut, spliced, and changed in bits, numbers, words and structure, in files"
        " and inside of sound files, and random bytes. Each is read in a process of its own kind, which may use"
        f" {LONGEST:.0f} s for one input and {MEMORY / 2**30:.0f} GiB beyond what it begins with. A defect is an error"
        " other than the reader's own, an end of the process, a hang, or a result that cannot be: a component changed"
        f" by what it refused, a file changed by being read, a robot of mass NaN. Defects: {defects}.",
        "",
        "| input | number | accepted | refused, by reason or error | defects | slowest [ms] | memory [MB] |",
        "| --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        refused = ", ".join(f"{reason} {number}" for reason, number in row["refused"].items())
        wrong = ", ".join(f"{what} {number}" for what, number in row["defects"].items()) or "none"
        lines.append(
            f"| {row['kind']} | {row['inputs']} | {row['accepted']} | {refused} | {wrong} |"
            f" {row['longest [s]'] * 1000.0:.0f} | {row['growth of memory [MB]']:.0f} |"
        )
    return lines


BENCH = Bench(
    "fuzz",
    "Inputs from outside",
    [(kind.name, kind.count) for kind in KINDS],
    measure,
    summarize,
)
