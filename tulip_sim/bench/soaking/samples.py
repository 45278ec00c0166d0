"""Samples of a soak on the disk: a file for each process, a JSON line for each sample, written as it comes."""

from __future__ import annotations

import json
import os
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

Sample = dict[str, Any]
SIMULATED = "simulated [s]"
"""Simulated time since the process began to play."""


@dataclass(frozen=True)
class Segment:
    """What one process, or one graph of processes, was seen to hold.

    Attributes:
        name: Of its file, without folder and ending.
        samples: In the order in which they came.
    """

    name: str
    samples: list[Sample]

    @property
    def duration(self) -> float:
        """Simulated time that was played [s]."""
        return float(self.samples[-1][SIMULATED]) if self.samples else 0.0


def new_segment(folder: Path, mode: str) -> Path:
    """Return a file for the samples of a process that begins now."""
    folder.mkdir(parents=True, exist_ok=True)
    return folder / f"{mode}_{time.strftime('%Y-%m-%d_%H-%M-%S')}_{os.getpid()}.jsonl"


def add(file: Path, sample: Sample) -> None:
    """Append a sample."""
    with open(file, "a", encoding="utf-8") as out:
        out.write(json.dumps(sample) + "\n")


def read(folder: Path, mode: str) -> list[Segment]:
    """Return all segments of a mode, the oldest first. A line that was cut off when its process ended is left out."""
    return [
        Segment(path.stem, [json.loads(line) for line in path.read_text().split("\n")[:-1]])
        for path in sorted(folder.glob(f"{mode}_*.jsonl"))
    ]
