"""Which transport: nodes that are killed and started again, and pictures between nodes, by each in turn."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from tulip_ros import transport
from tulip_sim.bench.free_port import own_domain
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.bench.transports import pictures, restarts

ROUNDS = 5
SMALL = "small segment"
WAYS = {
    "shared_memory": "shared memory, 16 MiB a process",
    "udp": "UDP by loopback",
    "auto": "auto: the first of these where it fits",
    SMALL: "shared memory as Fast DDS has it, 0.5 MiB",
}
PATIENCE = 600.0  # [s] for one trial


def trials(rounds: int = ROUNDS) -> list[tuple[int, str]]:
    """Return what to run: each transport once a round; each round begins with another."""
    ways = tuple(WAYS)
    return [(number + 1, ways[(number + turn) % len(ways)]) for number in range(rounds) for turn in range(len(ways))]


def choose(options: Mapping[str, str]) -> list[tuple[int, str]]:
    """Return fewer trials, by option `rounds`.

    Raises:
        ValueError: if an option is unknown or cannot be used.
    """
    rounds = options.get("rounds", str(ROUNDS))
    if set(options) - {"rounds"} or not rounds.isdecimal() or int(rounds) == 0:
        raise ValueError(f"options are {dict(options)}; expected rounds, a number > 0")
    return trials(int(rounds))


def measure(number: int, way: str) -> Row:
    """Measure one transport once.

    Raises:
        RuntimeError: if it cannot be measured; the nodes' own words stand above.
    """
    own_domain()
    with tempfile.TemporaryDirectory(prefix="tulip_transport_") as scratch:
        profile = _small(Path(scratch)) if way == SMALL else transport.profile_path(way)
        done = subprocess.run(
            [sys.executable, "-m", f"{restarts.__package__}.trial"],
            env={**os.environ, transport.PROFILE_VARIABLE: str(profile), transport.RANGE_VARIABLE: transport.RANGE},
            stdout=subprocess.PIPE,
            text=True,
            timeout=PATIENCE,
            check=False,
        )
        if done.returncode:
            raise RuntimeError(f"transport {way} was not measured")
        return {"round": number, "transport": way, "profile": profile.stem, **json.loads(done.stdout.splitlines()[-1])}


def _small(folder: Path) -> Path:
    """Return the profile of shared memory with Fast DDS's own sizes."""
    text = transport.profile_path("shared_memory").read_text()
    path = folder / "small_segment.xml"
    path.write_text(re.sub(r"<(segment_size|maxMessageSize)>\d+</\1>", "", text))
    return path


def summarize(rows: list[Row]) -> list[str]:
    """Return a table with a line for each transport."""
    rate = round(1.0 / pictures.PERIOD)
    lines = [
        f"Each transport in turn, {max(row['round'] for row in rows)} rounds. *Restart*: `kill -9` of a node, which is"
        f" at once started again, {restarts.KILLS} times a round and node, beside a body without physics and motion"
        " control: until another node has its topic in its graph (matched), and until a message of the new process"
        " comes (flows; `head` must hear the driver for that, `user_input` has a latched topic). Most of that is the"
        " start of Python: since it joined is the part from when its sockets are open, which is the transport's."
        f" *Pictures*: {pictures.WIDTH}x{pictures.HEIGHT} bgr8,"
        f" {rate} a second, from one node to two others; milliseconds from before they are sent until the callback has"
        " them, and processor time of sender and one receiver together. *Kill*: the other receiver is killed with"
        " `kill -9`: pictures that the first one then lost, and the longest that one took to be sent. Medians, and in"
        " brackets the greatest.",
        "",
        "| transport | restart: head matched | flows | since it joined | user_input matched | flows | since it joined"
        " | pictures: median | 99 %"
        " | most | lost | cores | kill: lost | sending |",
        "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |",
    ]
    for way, words in WAYS.items():
        own = [row for row in rows if row["transport"] == way]
        if not own:
            continue
        cells = [words if way != "auto" else f"auto: here {own[0]['profile']}"]
        for node in restarts.KILLED:
            joined, matched, flowing = (
                np.concatenate([row[f"{node} {moment} [s]"] for row in own]) for moment in restarts.MOMENTS
            )
            cells += [_told(matched, "s"), _told(flowing, "s"), _told(flowing - joined, "s")]
        for name in ("median [ms]", "99 % [ms]"):
            cells.append(f"{np.median([row[name] for row in own]):.1f} ms")
        cells.append(f"{max(row['most [ms]'] for row in own):.0f} ms")
        cells.append(_lost(own, ""))
        cells.append(f"{np.median([row['sender [core]'] + row['receiver [core]'] for row in own]):.2f}")
        cells.append(_lost(own, " after the kill"))
        cells.append(_told(np.array([row["longest sending after the kill [ms]"] for row in own]), "ms"))
        lines.append(f"| {' | '.join(cells)} |")
    return lines


def _told(values: np.ndarray, unit: str) -> str:
    digits = 2 if unit == "s" else 0
    return f"{np.median(values):.{digits}f} ({values.max():.{digits}f}) {unit}"


def _lost(rows: list[Row], when: str) -> str:
    return f"{sum(row[f'lost{when}'] for row in rows)} of {sum(row[f'sent{when}'] for row in rows)}"


BENCH = Bench("transport", "Transport", trials(), measure, summarize, workers=1, choose=choose)
