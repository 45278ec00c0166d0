"""Parts of recordings, and several in one, as new recordings."""

from __future__ import annotations

import heapq
import shutil
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from pathlib import Path

from tulip_ros.bag import FREE, Bag
from tulip_ros.errors import BadInputError
from tulip_ros.latched import latched_before
from tulip_ros.log_file import Log, LoggedTopic, Record

Advance = Callable[[int], None]
"""Is told how many messages were written since the last time."""

STEP = 1000  # messages between two looks at the free disk space, and at the progress bar
OLD = ".old"


def cut(log: Log, names: Sequence[str], start: int | None, end: int | None, folder: Path, advance: Advance) -> int:
    """Write a part of a recording into a new one, with all its notes and attachments.

    What was latched before the part stands at its beginning: whoever reads it wants the camera's lens, and the game.

    Args:
        log: To read.
        names: Of the topics wanted.
        start: First log time wanted [ns], or None.
        end: First log time not wanted any more [ns], or None.
        folder: For the new recording; see `Bag`.
        advance: For a progress bar.

    Returns:
        How many messages were written.

    Raises:
        BadInputError: if it cannot be written, or the recording is damaged.
    """
    with writing(folder) as bag:
        bag.copy_notes(log)
        before = []
        if start is not None:
            before = [replace(record, log_time=start) for record in latched_before(log, names, start)]
        return _write(bag, chain(before, log.records(names, start, end)), advance)


def merge(logs: Sequence[Log], folder: Path, advance: Advance) -> int:
    """Write several recordings into a new one, in the order of log times.

    Args:
        logs: To read. Notes and attachments keep their names, with the recording's name before each.
        folder: For the new recording; see `Bag`.
        advance: For a progress bar.

    Returns:
        How many messages were written.

    Raises:
        BadInputError: if a topic has different types in them, if it cannot be written, or one is damaged.
    """
    types: dict[str, tuple[LoggedTopic, Path]] = {}
    for log in logs:
        for name, topic in log.topics.items():
            first, where = types.setdefault(name, (topic, log.path))
            if (first.type_name, first.definition) != (topic.type_name, topic.definition):
                what = (
                    f"is {first.type_name} in {where} and {topic.type_name} in {log.path}"
                    if first.type_name != topic.type_name
                    else f"has another definition of {first.type_name} in {where} than in {log.path}"
                )
                raise BadInputError(f"Topic {name} {what}; expected the same. Cut it out of one of them first.")
    labels = [f"{log.path.stem}/" for log in logs]
    if len(set(labels)) < len(labels):
        labels = [f"{number}_{label}" for number, label in enumerate(labels, 1)]
    with writing(folder) as bag:
        for log, label in zip(logs, labels, strict=True):
            bag.copy_notes(log, label)
        streams = [log.records() for log in logs]
        return _write(bag, heapq.merge(*streams, key=lambda record: record.log_time), advance)


@contextmanager
def writing(folder: Path) -> Iterator[Bag]:
    """Open a new recording; what was begun of it is removed if the work does not come to its end.

    Raises:
        BadInputError: if it cannot be written.
    """
    existed = folder.exists()
    try:
        bag = Bag(folder)
    except BaseException:
        if not existed and folder.is_dir() and not any(folder.iterdir()):
            folder.rmdir()
        raise
    try:
        yield bag
        bag.close()
    except BaseException as error:
        shutil.rmtree(folder, ignore_errors=True)
        if isinstance(error, OSError):
            raise BadInputError(
                f"Recording {folder} cannot be written: {error.strerror or error}. Name another folder, or make room."
            ) from error
        raise


@contextmanager
def making_room(folder: Path, force: bool, sources: Sequence[Path]) -> Iterator[None]:
    """Refuse a folder that is in use; with `force`, a recording that is in it is replaced once the new one is complete.

    Args:
        folder: For the new recording.
        force: Whether an old one may be replaced.
        sources: Recordings that are read.

    Raises:
        BadInputError: if something is there that may not be replaced.
    """
    if folder.resolve() in {place for source in sources for place in (source.resolve(), source.resolve().parent)}:
        raise BadInputError(f"{folder} is read here itself; name another folder for the new recording.")
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        yield
        return
    if not force:
        raise BadInputError(f"{folder} exists; name another folder, or give --force to replace the recording in it.")
    foreign = [] if not folder.is_dir() else [each.name for each in folder.iterdir() if not _belongs(each)]
    if not folder.is_dir() or foreign:
        held = f"holds {foreign[0]}, which is no part of a recording" if foreign else "is no folder"
        raise BadInputError(
            f"{folder} {held}; expected a recording. --force replaces nothing else: remove it yourself."
        )
    old = folder.with_name(folder.name + OLD)
    if old.exists():
        raise BadInputError(f"{old} exists, where the old recording would wait; move it away first.")
    folder.rename(old)
    try:
        yield
    except BaseException:
        old.rename(folder)
        raise
    shutil.rmtree(old)


def _belongs(path: Path) -> bool:
    return path.is_file() and (path.suffix == ".mcap" or path.name == "metadata.yaml")


def _write(bag: Bag, records: Iterator[Record], advance: Advance) -> int:
    for number, record in enumerate(records, 1):
        bag.copy(record)
        if number % STEP == 0:
            advance(STEP)
            if not bag.has_space():
                raise BadInputError(
                    f"Less than {FREE // 2**20} MiB are free at {bag.folder}; make room or name another folder."
                )
    advance(bag.messages % STEP)
    return bag.messages
