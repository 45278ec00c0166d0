"""What the commands of calibrate.py share: reading pictures, telling errors, showing progress."""

from __future__ import annotations

import functools
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import ParamSpec, TypeVar

import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
from tulip_vision.coded_picture import decode_picture

Picture = NDArray[np.uint8]
P = ParamSpec("P")
Item = TypeVar("Item")


def told(command: Callable[P, None]) -> Callable[P, None]:
    """Tell what cannot be used in one line, with exit code 2."""

    @functools.wraps(command)
    def run(*arguments: P.args, **options: P.kwargs) -> None:
        try:
            command(*arguments, **options)
        except (BadInputError, ValueError) as error:
            print(f"error: {error}", file=sys.stderr)
            raise typer.Exit(EXIT_BAD_INPUT) from None

    return run


def make_folder(folder: Path) -> None:
    """Make a folder, or take an empty one."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInputError(f"Folder {folder} is not empty; name a new one.")
    except OSError as error:
        raise BadInputError(f"Folder {folder} cannot be made: {error.strerror}.") from error


def read_picture(path: Path) -> Picture:
    """Return a picture, (height, width, 3) BGR."""
    try:
        return decode_picture(path.read_bytes())
    except OSError as error:
        raise BadInputError(f"Picture {path} cannot be read: {error.strerror}.") from error
    except ValueError as error:
        raise BadInputError(f"Picture {path} is none that can be read: {error}.") from error


def read_pictures(paths: list[Path]) -> dict[str, Picture]:
    """Return pictures by the names that were given; all of one size."""
    found: dict[str, Picture] = {}
    for path in paths:
        picture = read_picture(path)
        first = next(iter(found.values()), picture)
        if picture.shape != first.shape:
            raise BadInputError(
                f"Picture {path} has {picture.shape[1]} x {picture.shape[0]} px, {next(iter(found))} has"
                f" {first.shape[1]} x {first.shape[0]} px; expected all of one size, from one camera."
            )
        found[str(path)] = picture
    return found


@contextmanager
def progress_bar(text: str, total: int, console: Console) -> Iterator[Callable[[], None]]:
    """Show a progress bar; what is yielded is to be called after each of the `total` steps."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bar:
        task = bar.add_task(text, total=total)
        yield lambda: bar.advance(task)


def track(items: Sequence[Item], text: str, console: Console) -> Iterator[Item]:
    """Go through a list with a progress bar."""
    with progress_bar(text, len(items), console) as advance:
        for item in items:
            yield item
            advance()
