"""Rows of finished jobs, each written the moment it is there: nothing is lost when a batch is killed.

The first line tells what was played, each further line is a row, as JSON. A row is one write to the end of the file,
and a line that a crash has cut off is dropped. Only one process at a time writes a journal.
"""

from __future__ import annotations

import fcntl
import json
import os
from pathlib import Path
from types import TracebackType
from typing import Any

from tulip_ros.errors import BadInputError
from tulip_sim.batch.jobs import Batch, Job, Row

FORMAT = 1
_BEGINNING = b'{"format":'


class Journal:
    """An open journal.

    Attributes:
        rows: All rows, in the order in which they came.
    """

    def __init__(self, path: Path, batch: Batch) -> None:
        """Open a journal, or begin one.

        Args:
            path: The file.
            batch: What is played.

        Raises:
            BadInputError: if it cannot be written, is written by another process, is no journal, or belongs to another
                batch.
        """
        self._path = path
        self.rows: list[Row] = []
        try:
            self._file = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT, 0o644)
        except OSError as error:
            raise BadInputError(f"Journal {path} cannot be written: {error.strerror}. Name another file.") from error
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            os.close(self._file)
            raise BadInputError(f"Journal {path} is being written by another batch. Name another file.") from error
        try:
            self._read(batch.fingerprint())
        except BaseException:
            self.close()
            raise

    def add(self, row: Row) -> None:
        """Append a row; it is on the disk when this returns.

        Raises:
            BadInputError: if it cannot be written, as when the disk is full.
        """
        self._append(row)
        self.rows.append(row)

    def done(self) -> set[Job]:
        """Return the jobs that have a row."""
        return {Job(row["set"], row["seed"]) for row in self.rows}

    def close(self) -> None:
        """Close the file."""
        os.close(self._file)

    def __enter__(self) -> Journal:
        """Return the journal itself."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close the file."""
        self.close()

    def _append(self, values: dict[str, Any]) -> None:
        line = (json.dumps(values) + "\n").encode()
        try:
            written = os.write(self._file, line)
            os.fsync(self._file)
        except OSError as error:
            raise BadInputError(f"Journal {self._path} cannot be written: {error.strerror}.") from error
        if written < len(line):
            raise BadInputError(f"Journal {self._path} cannot be written: the disk is full.")

    def _read(self, fingerprint: dict[str, Any]) -> None:
        data = self._path.read_bytes()
        whole = data.rfind(b"\n") + 1
        if not whole and _BEGINNING.startswith(data[: len(_BEGINNING)]):  # new, or killed while it was begun
            os.ftruncate(self._file, 0)
            self._append({"format": FORMAT, **fingerprint})
            return
        try:
            head, *rows = [json.loads(line) for line in data[:whole].splitlines()]
            told = {name: head[name] for name in fingerprint}
            self.rows = [dict(row) for row in rows]
            self.done()
        except (ValueError, KeyError, TypeError) as error:
            raise BadInputError(f"{self._path} is no journal of a batch. Name another results file.") from error
        if head.get("format") != FORMAT or told != fingerprint:
            raise BadInputError(
                f"{self._path} belongs to another batch: {_difference(told, fingerprint)}."
                " Name another results file, or delete this one."
            )
        os.ftruncate(self._file, whole)


def _difference(old: dict[str, Any], new: dict[str, Any]) -> str:
    for name in ("play", "scenario"):
        if old[name] != new[name]:
            return f"its {name} is {old[name]!r}, not {new[name]!r}"
    names = sorted(set(old["sets"]) ^ set(new["sets"]))
    if names:
        return f"only one of the two has parameter set {', '.join(names)}"
    changed = [name for name in new["sets"] if old["sets"][name] != new["sets"][name]]
    return f"parameters of set {', '.join(changed)} differ" if changed else "its format is another"
