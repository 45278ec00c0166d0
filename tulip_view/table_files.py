"""Tables as files: CSV, Parquet and MATLAB."""

from __future__ import annotations

import csv
import importlib.util
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
from scipy.io import savemat

from tulip_ros.errors import BadInputError, check_new_file
from tulip_view.tables import Table

MATLAB_NAME = re.compile(r"[A-Za-z]\w*$", re.ASCII)
MATLAB_LONGEST = 63
MATLAB_KEYWORDS = frozenset(
    "break case catch classdef continue else elseif end for function global if otherwise parfor persistent return "
    "spmd switch try while".split()
)
ABOUT = ".columns.csv"
"""Ending of the file beside a CSV file that tells unit, topic and alignment of each column."""


def check_target(path: Path, force: bool) -> None:
    """Refuse a file that cannot be written, before the work for it is done.

    Raises:
        BadInputError: if it exists and may not be replaced, its ending is unknown, or a library for it is missing.
    """
    if path.suffix not in WRITERS:
        raise BadInputError(f"--to {path} ends in {path.suffix or 'nothing'}; expected {' or '.join(WRITERS)}.")
    if path.suffix == ".parquet" and importlib.util.find_spec("pyarrow") is None:
        raise BadInputError(
            "Parquet needs the library pyarrow, which is not installed. Install the project's extra `batch` "
            "(pip install -e '.[batch]'), or export to .csv or .mat."
        )
    for file in files_of(path):
        check_new_file(file, "--to", force)


def files_of(path: Path) -> list[Path]:
    """Return the files that `write_table` will write for a name."""
    return [path, path.with_name(path.name.removesuffix(".csv") + ABOUT)] if path.suffix == ".csv" else [path]


def write_table(table: Table, path: Path) -> None:
    """Write a table; an old file is replaced once the new one is complete.

    Raises:
        BadInputError: if it cannot be written.
    """
    part = path.with_name(path.name + ".part")
    try:
        WRITERS[path.suffix](table, part)
        if path.suffix == ".csv":
            _write_about(table, files_of(path)[1])
        os.replace(part, path)
    except OSError as error:
        raise BadInputError(f"{path} cannot be written: {error.strerror or error}. Name another file.") from error
    finally:
        part.unlink(missing_ok=True)


def _write_csv(table: Table, path: Path) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([column.name for column in table.columns])
        lists = [
            values.tolist() if column.words else [f"{value:.9g}" if value == value else "" for value in values]
            for column, values in zip(table.columns, table.values, strict=True)
        ]
        writer.writerows(zip(*lists, strict=True))


def _write_about(table: Table, path: Path) -> None:
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(["column", "unit", "topic", "between messages"])
        for column, origin in zip(table.columns, table.origins, strict=True):
            writer.writerow([column.name, column.unit, origin, column.alignment.value])


def _write_parquet(table: Table, path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    fields, arrays = [], []
    for column, values, origin in zip(table.columns, table.values, table.origins, strict=True):
        kind = pa.string() if column.words else pa.float64()
        notes = {"unit": column.unit, "topic": origin, "between messages": column.alignment.value}
        fields.append(pa.field(column.name, kind, metadata=notes))
        arrays.append(pa.array(values.tolist() if column.words else values, kind))
    pq.write_table(pa.table(arrays, schema=pa.schema(fields)), path, compression="zstd")


def _write_matlab(table: Table, path: Path) -> None:
    content: dict[str, object] = {}
    about = np.empty((len(table.columns), 4), dtype=object)
    for number, (column, values, origin) in enumerate(zip(table.columns, table.values, table.origins, strict=True)):
        if not is_matlab_name(column.name):
            raise ValueError(
                f"column {column.name} is no MATLAB name; expected at most {MATLAB_LONGEST} letters, _, 0-9"
            )
        content[column.name] = values.reshape(-1, 1)
        about[number] = [column.name, column.unit, origin, column.alignment.value]
    content["columns"] = about
    savemat(str(path), content, appendmat=False, do_compression=True, long_field_names=True)


def is_matlab_name(name: str) -> bool:
    """Return whether MATLAB takes a name for a variable."""
    return bool(MATLAB_NAME.match(name)) and len(name) <= MATLAB_LONGEST and name not in MATLAB_KEYWORDS


WRITERS: dict[str, Callable[[Table, Path], None]] = {
    ".csv": _write_csv,
    ".parquet": _write_parquet,
    ".mat": _write_matlab,
}
