"""Time-aligned tables: values of different topics at the same instants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tulip_ros.errors import BadInputError, unknown
from tulip_view.columns import GROUPS, SOURCES, Alignment, Column, Source
from tulip_view.recording import ALL, Array, Recording, Track, Wanted

LONGEST_GAP = 1.0
"""[s] Between messages that lie further apart than this nothing is interpolated."""
MOST_ROWS = 5_000_000
MOST_VALUES = 100_000_000  # in all columns: 0.8 GB
TIME = Column("time_s", "s", Alignment.LINEAR)


@dataclass
class Table:
    """Columns of equal length.

    Attributes:
        columns: What they are; the first is the time.
        values: (n,) of each: numbers, or words (dtype object) where there are some. NaN and "" where nothing is known.
        origins: The topic that each comes from.
        left_out: Topics that the recording lacks, each with what was left out for that.
    """

    columns: list[Column]
    values: list[NDArray[Any]]
    origins: list[str]
    left_out: list[str]

    def __len__(self) -> int:
        return len(self.values[0])

    def __getitem__(self, name: str) -> NDArray[Any]:
        return self.values[[column.name for column in self.columns].index(name)]


def sources_of(groups: Sequence[str]) -> list[Source]:
    """Return the sources of some groups of columns.

    Raises:
        BadInputError: if there is no such group.
    """
    for group in groups:
        if group not in GROUPS:
            raise unknown("group of columns", group, GROUPS)
    return [source for source in SOURCES if source.group in groups]


def topics_of(sources: Sequence[Source], times_of: str | None = None) -> dict[str, Wanted]:
    """Return what is to be read for these sources.

    Args:
        sources: The sources.
        times_of: A topic whose times are wanted besides.
    """
    wanted = {source.topic.name: ALL for source in sources}
    if times_of is not None:
        wanted.setdefault(times_of, Wanted(decoded=False))
    return wanted


def regular_times(recording: Recording, rate: float) -> Array:
    """Return instants from begin to end at a rate.

    Args:
        recording: What was read.
        rate: [1/s].

    Raises:
        BadInputError: if that makes more rows than fit into memory, or the rate is not positive.
    """
    if not rate > 0.0 or not np.isfinite(rate):
        raise BadInputError(f"--rate is {rate:g} Hz; expected more than 0.")
    count = (recording.end - recording.begin) * rate
    if count > MOST_ROWS:
        raise BadInputError(f"--rate {rate:g} Hz makes {count:.0f} rows; expected at most {MOST_ROWS}. Choose less.")
    # Whole nanoseconds, as stamps are: an instant that is that of a message is exactly so.
    return np.round(recording.begin + np.arange(int(count + 1e-6) + 1) / rate, 9)


def native_times(recording: Recording, topic: str) -> Array:
    """Return the instants of one topic's messages, each once.

    Raises:
        BadInputError: if the recording has none of it.
    """
    track = recording.tracks.get(topic)
    if track is None:
        raise unknown("topic with messages", topic, recording.tracks)
    return np.unique(track.times)


def make_table(recording: Recording, sources: Sequence[Source], times: Array) -> Table:
    """Return a table.

    Args:
        recording: What was read; see `topics_of`.
        sources: Where columns come from; those whose topics are not in the recording are left out.
        times: (n,) ascending instants [s].

    Raises:
        BadInputError: if that makes more values than fit into memory.
    """
    columns = sum(len(source.columns) for source in sources if recording.get(source.topic) is not None)
    if columns * len(times) > MOST_VALUES:
        raise BadInputError(
            f"A table of {columns} columns and {len(times)} rows holds more than {MOST_VALUES} values:"
            f" {recording.end - recording.begin:.0f} s are recorded, or damaged stamps say so. Choose a lower --rate."
        )
    table = Table([TIME], [times], [""], [])
    for source in sources:
        track = recording.get(source.topic)
        if track is None:
            first, last = source.columns[0].name, source.columns[-1].name
            table.left_out.append(f"{source.topic.name}: {first} to {last} ({len(source.columns)} columns)")
            continue
        rows = [source.values(message) for message in track.messages]
        for number, column in enumerate(source.columns):
            given = np.array([row[number] for row in rows], dtype=object if column.words else np.float64)
            table.columns.append(column)
            table.values.append(align(track, np.cumsum(given) if source.running else given, column.alignment, times))
            table.origins.append(source.topic.name)
    return table


def align(track: Track, values: NDArray[Any], alignment: Alignment, times: Array) -> NDArray[Any]:
    """Return (n,) values at other instants than those of the messages.

    Before the first message nothing is known; after the last one, the last value of what is not interpolated holds.

    Args:
        track: The messages.
        values: (m,) one of each message.
        alignment: What is done between messages.
        times: (n,) instants [s].
    """
    before = np.searchsorted(track.times, times, side="right") - 1
    known = before >= 0
    low = np.maximum(before, 0)
    if alignment is Alignment.LAST:
        nothing: Any = "" if values.dtype == object else np.nan
        held: NDArray[Any] = np.where(known, values[low], nothing)
        return held
    high = np.minimum(low + 1, len(values) - 1)
    span = track.times[high] - track.times[low]
    share = np.divide(times - track.times[low], span, out=np.zeros(len(times)), where=span > 0.0)
    exact = times == track.times[low]
    step = values[high] - values[low]
    if alignment is Alignment.ANGLE:
        step = (step + np.pi) % (2.0 * np.pi) - np.pi
    found = values[low] + share * step
    if alignment is Alignment.ANGLE:
        found = (found + np.pi) % (2.0 * np.pi) - np.pi
    inside = known & (times <= track.times[-1]) & (span <= LONGEST_GAP)
    result: Array = np.where(exact & known, values[low], np.where(inside, found, np.nan))
    return result
