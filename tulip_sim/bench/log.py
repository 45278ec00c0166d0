"""Recording: cost, speed, size, recomputing, and what is left when the recorder is killed."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from tulip_sim.bench import log_kill, log_match, log_recompute, log_replay, log_throughput
from tulip_sim.bench.free_port import own_domain
from tulip_sim.bench.runner import Bench, Row

SHARE, SIZE, LOSS = 0.10, 150.0, 1.0  # asked for: of a core; [MB] of 10 minutes; [s] lost at most
LATE = 2.0  # [ms] asked for
KILLS = 20
WRITERS = {"ours": "ours", "rosbags kept": "ours", "ours not kept": "ours not kept", "rosbags": "ours not kept"}
"""With the one that each is compared with."""
PARTS: dict[str, Callable[..., Row]] = {
    "match": log_match.measure,
    "throughput": log_throughput.measure,
    "replay": log_replay.measure,
    "kill": log_kill.measure,
    "recompute": log_recompute.measure,
}
TRIALS = [
    ("match", 1, 1),
    ("match", 2, 1),
    ("throughput", "small messages"),
    ("throughput", "pictures"),
    ("throughput", "raw pictures"),
    ("replay", 1.0),
    ("replay", 2.0),
    *(("recompute", *trial) for trial in log_recompute.TRIALS),
    *(("kill", number) for number in range(1, KILLS + 1)),
]


def measure(part: str, *arguments: float | str) -> Row:
    """Run one trial of a part."""
    own_domain()  # no other graph on this machine is recorded
    return PARTS[part](*arguments)


def summarize(rows: list[Row]) -> list[str]:
    """Return a table for each part."""
    lines: list[str] = []
    for part, tell in (
        ("match", _matches),
        ("throughput", _throughput),
        ("replay", _replays),
        ("recompute", log_recompute.lines),
        ("kill", _kills),
    ):
        of_part = [row for row in rows if row["part"] == part]
        if of_part:
            lines += ["", *tell(of_part)] if lines else tell(of_part)
    return lines


def _matches(rows: list[Row]) -> list[str]:
    lines = [
        f"A graph with camera is recorded for {log_match.WATCHED:.0f} s of play: all topics, pictures as JPEG. Asked"
        f" for: {SHARE:.0%} of a core in real time, nothing lost, 10 minutes in {SIZE:.0f} MB (extrapolated from that"
        " time). CPU by simulated time is the core's share at real time; it counts more than it should"
        " where the simulation is slower than real time, as some of the work comes by the wall clock.",
        "",
        "| robots | real-time factor | share of a core | CPU by simulated time | messages | lost"
        " | one picture | 10 minutes | of it pictures |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        share = row["pictures [MB]"] / max(row["written [MB]"], 1e-9)
        lines.append(
            f"| {row['robots']} | {row['real-time factor']} | {row['recorder, share of a core']:.1%}"
            f" | {row['recorder [s] per simulated second']:.1%} | {row['messages']} | {row['lost']}"
            f" | {row['one picture [kB]']} kB | {row['10 minutes [MB]']} MB | {share:.0%} |"
        )
    return lines


def _throughput(rows: list[Row]) -> list[str]:
    lines = [
        f"Writers in turns in one process, median of {log_throughput.ROUNDS} rounds, with the file's end; compressed"
        " with zstd, as recordings are, and not compressed. Ours has the disk keep what is written, all the time, so"
        " that a loss of power costs a second; rosbags' writer never asks for that. So it is compared with one such"
        " request at its end (`kept`), and as it is with ours told not to ask (`not kept`, `record.py --no-sync`)."
        " Asked for: at least as fast.",
        "",
        "| messages | writer | zstd | of ours | not compressed | of ours |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        what = f"{row['messages']} {row['kind']} of {row['bytes each']} B"
        for name, ours in WRITERS.items():
            cells = []
            for suffix in (" zstd", ""):
                speed = row[f"{name}{suffix} [1/s]"]
                megabytes = f"{row[f'{name}{suffix} [MB/s]']:.0f} MB/s, {row[f'{name}{suffix} [MB written]']:.0f} MB"
                cells += [f"{speed} / s, {megabytes}", f"{speed / row[f'{ours}{suffix} [1/s]']:.2f}"]
            lines.append(f"| {what} | {name.replace(' ', ', ', 1)} | {' | '.join(cells)} |")
            what = ""
    return lines


def _replays(rows: list[Row]) -> list[str]:
    lines = [
        f"A trial of lockstep is replayed for {log_replay.PLAYED:.0f} s and recorded again: by how much the time when a"
        " message arrived, as the middleware notes it, differs from the recorded one. Asked for:"
        f" {LATE:.0f} ms in the median.",
        "",
        "| rate | messages | arrived | median | 99 % below | greatest |",
        "| --- | --- | --- | --- | --- | --- |",
    ]
    for row in rows:
        late = " | ".join(f"{row[name]} ms" for name in ("median [ms]", "99 % [ms]", "greatest [ms]"))
        lines.append(f"| {row['rate']:g} | {row['messages']} | {row['arrived']} | {late} |")
    return lines


def _kills(rows: list[Row]) -> list[str]:
    losses = [row["lost [s]"] for row in rows]
    equal = sum(row["equal"] for row in rows)
    return [
        f"`kill -9` of the recorder at {len(rows)} random moments, 1000 small messages and 15 pictures a second:"
        f" after `recover.py`, {equal} of {len(rows)} recordings are, read by rosbags, message by message what an"
        f" independent subscriber got, up to {np.median(losses):.2f} s (median; at most {max(losses):.2f} s) before the"
        f" kill. Asked for: all, {LOSS:.0f} s at most.",
    ]


BENCH = Bench("log", "Recording", TRIALS, measure, summarize, workers=1)
