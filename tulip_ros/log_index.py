"""One MCAP file by its index: what the index says, and the notes and attached files to which it points.

Every number in a file may be a lie. No more is read than the file holds, nothing is read again and again, and no chunk
is unpacked on the way to something else.
"""

from __future__ import annotations

import io
import struct
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TypeVar

from mcap.exceptions import McapError
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    Footer,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader
from mcap.summary import Summary

from tulip_ros.errors import BadInputError
from tulip_ros.log_chunks import LATEST
from tulip_ros.mcap_file import MAGIC

FOOTER = 29  # [B]
SHORTEST = 2 * len(MAGIC) + FOOTER
DAMAGES = (McapError, ValueError, LookupError, EOFError, RuntimeError, MemoryError, OverflowError, struct.error)
"""What a reader raises on meeting damaged bytes."""

R = TypeVar("R", Attachment, Metadata)


class DamagedLogError(BadInputError):
    """A recording that was not ended as it should be, or is damaged; `scripts/recover.py` mends it."""

    def __init__(self, path: Path, what: str) -> None:
        super().__init__(f"Recording {path} {what}. Mend it first: python3 scripts/recover.py {path}")
        self.path, self._what = path, what

    def __reduce__(self) -> tuple[type[DamagedLogError], tuple[Path, str]]:
        """Go from one process to another."""
        return DamagedLogError, (self.path, self._what)


class IndexedFile(io.BufferedReader):
    """A file that is open for reading.

    Attributes:
        path: Its name.
        size: [B] when it was opened.
        summary: Its index.
    """

    def __init__(self, path: Path) -> None:
        """Open a file.

        Raises:
            DamagedLogError: if it has no index, or is cut or damaged.
            BadInputError: if it is no MCAP file, or cannot be read.
        """
        self.path = path
        try:
            super().__init__(io.FileIO(path))
            self.size = path.stat().st_size
        except OSError as error:
            raise BadInputError(f"Recording {path} cannot be read: {error.strerror or error}.") from error
        try:
            self.summary = self._summary()
        except BaseException:
            self.close()
            raise

    def read(self, size: int | None = -1, /) -> bytes:
        """Return so many bytes, or what is left."""
        return super().read(size if size is None else min(size, self.size))

    def seek(self, offset: int, whence: int = io.SEEK_SET, /) -> int:
        """Go to a place, or to the end if it lies behind that."""
        return super().seek(min(offset, self.size), whence)

    def metadata(self) -> list[Metadata]:
        """Return the notes.

        Raises:
            DamagedLogError: if one is damaged.
        """
        with damages_of(self.path):
            return list(self._entries(Metadata, (each.offset for each in self.summary.metadata_indexes)))

    def attachments(self) -> list[Attachment]:
        """Return the attached files.

        Raises:
            DamagedLogError: if one is damaged.
        """
        with damages_of(self.path):
            return list(self._entries(Attachment, (each.offset for each in self.summary.attachment_indexes)))

    def _entries(self, kind: type[R], places: Iterable[int]) -> Iterator[R]:
        for place in places:
            self.seek(place)
            record = next(self._records(), None)
            if not isinstance(record, kind):
                raise McapError(f"there is no {kind.__name__.lower()} at byte {place}, where the index has one")
            yield record

    def _records(self) -> Iterator[object]:
        reader = StreamReader(self, skip_magic=True, emit_chunks=True, record_size_limit=self.size)
        return iter(reader.records)

    def _summary(self) -> Summary:
        try:
            begin = self.read(len(MAGIC))
            if not begin:
                raise BadInputError(
                    f"Recording {self.path} is empty: nothing was written before its recorder ended."
                    " Expected an MCAP file."
                )
            if begin != MAGIC:
                raise BadInputError(f"{self.path} is no MCAP file; expected a recording of `record.py` or `match.py`.")
            if self.size < SHORTEST:
                raise DamagedLogError(self.path, "is cut")
            self.seek(-(FOOTER + len(MAGIC)), io.SEEK_END)
            footer = next(self._records(), None)
            if not isinstance(footer, Footer):
                raise McapError("there is no footer at the end")
            if footer.summary_start:
                self.seek(footer.summary_start)
                summary = _collected(self._records())
                if summary.statistics is not None:
                    _check(summary, self.size)
                    return summary
        except OSError as error:
            raise BadInputError(f"Recording {self.path} cannot be read: {error.strerror or error}.") from error
        except DAMAGES as error:
            raise DamagedLogError(self.path, "was not ended properly, or is cut") from error
        raise DamagedLogError(self.path, "has no index")


@contextmanager
def damages_of(path: Path) -> Iterator[None]:
    """Turn what a reader raises on meeting damaged bytes into the error that says so.

    Raises:
        DamagedLogError: for one of DAMAGES.
    """
    try:
        yield
    except DAMAGES as error:
        raise DamagedLogError(path, f"is damaged ({error})") from error


def _collected(records: Iterable[object]) -> Summary:
    """Return the index that is in some records, which end with the footer."""
    summary = Summary()
    for record in records:
        if isinstance(record, Statistics):
            summary.statistics = record
        elif isinstance(record, Schema):
            summary.schemas[record.id] = record
        elif isinstance(record, Channel):
            summary.channels[record.id] = record
        elif isinstance(record, ChunkIndex):
            summary.chunk_indexes.append(record)
        elif isinstance(record, AttachmentIndex):
            summary.attachment_indexes.append(record)
        elif isinstance(record, MetadataIndex):
            summary.metadata_indexes.append(record)
    return summary


def _check(summary: Summary, size: int) -> None:
    """Raise ValueError for an index that has more than the file holds: the same bytes would be read again and again."""
    entries = (*summary.attachment_indexes, *summary.metadata_indexes)
    places = [each.chunk_start_offset for each in summary.chunk_indexes] + [each.offset for each in entries]
    length = sum(each.chunk_length for each in summary.chunk_indexes) + sum(each.length for each in entries)
    if len(set(places)) < len(places) or length > size:
        raise ValueError("its index has more than it holds")
    statistics = summary.statistics
    if statistics is not None and statistics.message_count and statistics.message_end_time > LATEST:
        raise ValueError("its index has times that cannot be")
