"""One MCAP file, written chunk by chunk: fast for many small messages, whole at every moment between two records."""

from __future__ import annotations

import os
import struct
from array import array
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

import zstandard
from isal.isal_zlib import crc32
from mcap.data_stream import RecordBuilder
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
    SummaryOffset,
)
from mcap.well_known import Profile

MAGIC = b"\x89MCAP0\r\n"
LIBRARY = "tulip_ros"
"""Names the program in files that it writes, whose messages are numbered from 0 on."""
COMPRESSIONS = ("zstd", "none")
LARGE = 65536  # [B] of a message, from which on writing it by itself is cheaper than copying it
LEVEL = 1  # of zstd: on a match two thirds of level 3's time, for 1 % more bytes
MESSAGE = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log time, publish time
MESSAGE_FIXED = MESSAGE.size - 9  # [B] of a message beside its data
INDEX = struct.Struct("<BQHI")  # opcode, length, channel, length of the entries
CHUNK = struct.Struct("<BQQQQI")  # opcode, length, first and last log time, size and checksum of what it holds


class Chunk:
    """Records that are compressed and written together."""

    def __init__(self) -> None:
        self.size = 0
        self.first = 0
        self.last = 0
        self.messages = 0
        self.indices: dict[int, array[int]] = {}
        """Log time and place of each message in turn, by channel."""
        self._parts: list[bytes] = []

    def add(self, channel: int, sequence: int, log_time: int, publish_time: int, data: bytes) -> None:
        """Add a message; times in [ns]."""
        index = self.indices.get(channel)
        if index is None:
            index = self.indices[channel] = array("Q")
        index.append(log_time)
        index.append(self.size)
        length = MESSAGE_FIXED + len(data)
        self._parts.append(MESSAGE.pack(Opcode.MESSAGE, length, channel, sequence, log_time, publish_time))
        self._parts.append(data)
        self.size += 9 + length
        if self.messages == 0:
            self.first = self.last = log_time
        elif log_time > self.last:
            self.last = log_time
        elif log_time < self.first:
            self.first = log_time
        self.messages += 1

    def add_definition(self, record: Schema | Channel) -> None:
        """Add a schema or a channel."""
        data = encode(record)
        self._parts.append(data)
        self.size += len(data)

    def content(self) -> bytes:
        """Return all records, not compressed."""
        return b"".join(self._parts)

    def pieces(self) -> list[bytes]:
        """Return the same in pieces, none of them small: large messages, as pictures, are not copied."""
        pieces: list[bytes] = []
        for is_large, group in groupby(self._parts, lambda part: len(part) > LARGE):
            parts = list(group)
            pieces += parts if is_large else [b"".join(parts)]
        return pieces


class McapFile:
    """Appends records to a new file and ends it with an index.

    A record that does not fit on the disk any more is taken back, so the file ends with a whole record at any time.
    """

    def __init__(self, path: Path, library: str = LIBRARY, compression: str = "zstd", sync: bool = True) -> None:
        """Begin the file.

        Args:
            path: Of the new file.
            library: Name of the program that writes it.
            compression: Of chunks: one of `COMPRESSIONS`.
            sync: Whether `sync` does anything.

        Raises:
            OSError: if it exists, or cannot be written.
        """
        self.path = path
        self.size = 0
        """Bytes written so far."""
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: dict[int, int] = {}
        """Messages by channel."""
        self.first = self.last = self.messages = 0
        self._chunk_indices: list[bytes] = []
        self._metadata: list[MetadataIndex] = []
        self._attachments: list[AttachmentIndex] = []
        self._compressor = zstandard.ZstdCompressor(level=LEVEL) if compression == "zstd" else None
        self._syncs = sync
        self._stream = open(path, "xb", buffering=0)
        self._append(MAGIC, encode(Header(Profile.ROS2, library)))

        self.finished = False
        """Whether the file has its index."""

    @property
    def closed(self) -> bool:
        """Whether no more can be written."""
        return self._stream.closed

    def add_definitions(self, records: Sequence[Schema | Channel]) -> None:
        """Write schemas or channels, and list them in the index.

        Raises:
            OSError: if they cannot be written.
        """
        self._append(*map(encode, records))
        for record in records:
            known = self.schemas if isinstance(record, Schema) else self.channels
            known[record.id] = record

    def add_metadata(self, name: str, data: Mapping[str, str]) -> None:
        """Write names and values.

        Raises:
            OSError: if they cannot be written.
        """
        record = encode(Metadata(name=name, metadata=dict(data)))
        offset = self.size
        self._append(record)
        self._metadata.append(MetadataIndex(offset=offset, length=len(record), name=name))

    def add_attachment(self, attachment: Attachment) -> None:
        """Write a file that belongs to the recording.

        Raises:
            OSError: if it cannot be written.
        """
        record = encode(attachment)
        offset = self.size
        self._append(record)
        index = AttachmentIndex(
            offset=offset,
            length=len(record),
            log_time=attachment.log_time,
            create_time=attachment.create_time,
            data_size=len(attachment.data),
            name=attachment.name,
            media_type=attachment.media_type,
        )
        self._attachments.append(index)

    def add_chunk(self, chunk: Chunk) -> None:
        """Compress a chunk and write it with its index.

        Raises:
            OSError: if it cannot be written.
        """
        span = chunk.first, chunk.last
        if self._compressor is None:
            pieces, checksum = chunk.pieces(), 0
            for piece in pieces:
                checksum = crc32(piece, checksum)
            self.add_compressed(pieces, "", span, chunk.size, checksum, chunk.indices)
        else:
            content = chunk.content()
            pieces = [self._compressor.compress(content)]
            self.add_compressed(pieces, "zstd", span, len(content), crc32(content), chunk.indices)

    def add_compressed(
        self,
        pieces: Sequence[bytes | memoryview],
        compression: str,
        span: tuple[int, int],
        size: int,
        checksum: int,
        indices: Mapping[int, array[int]],
    ) -> None:
        """Write a chunk that is compressed already.

        Args:
            pieces: Its records, compressed; one behind the other.
            compression: How: "zstd", "lz4", or "" for not at all.
            span: First and last log time [ns].
            size: Of the records before they were compressed [B].
            checksum: CRC-32 of those, or 0 for none.
            indices: Log time and place of each message in turn, by channel.

        Raises:
            OSError: if it cannot be written.
        """
        name = compression.encode()
        packed = sum(map(len, pieces))
        fixed = 8 + 8 + 8 + 4 + 4 + len(name) + 8
        begin = (
            CHUNK.pack(Opcode.CHUNK, fixed + packed, *span, size, checksum)
            + struct.pack("<I", len(name))
            + name
            + struct.pack("<Q", packed)
        )
        offset, length = self.size, len(begin) + packed
        places: dict[int, int] = {}
        records: list[bytes] = []
        place = offset + length
        for channel, index in indices.items():
            entries = index.tobytes()
            record = INDEX.pack(Opcode.MESSAGE_INDEX, 6 + len(entries), channel, len(entries)) + entries
            places[channel] = place
            place += len(record)
            records.append(record)
        self._append(begin, *pieces, *records)
        self._chunk_indices.append(
            encode(
                ChunkIndex(
                    message_start_time=span[0],
                    message_end_time=span[1],
                    chunk_start_offset=offset,
                    chunk_length=length,
                    message_index_offsets=places,
                    message_index_length=place - offset - length,
                    compression=compression,
                    compressed_size=packed,
                    uncompressed_size=size,
                )
            )
        )
        self._count(span, indices)

    def sync(self) -> None:
        """Have all that was written survive a loss of power.

        Raises:
            OSError: if the disk refuses.
        """
        if self._syncs:
            os.fdatasync(self._stream.fileno())

    def finish(self) -> None:
        """Write the index and close the file; without room for the index the file stays open, and whole but for it.

        Raises:
            OSError: if the index cannot be written.
        """
        summary = self._summary(self.size + len(encode(DataEnd(0))))
        self._append(encode(DataEnd(0)), summary, MAGIC)
        self.finished = True
        self.sync()
        self._stream.close()

    def abandon(self) -> None:
        """Close the file without an index."""
        self._stream.close()

    def _count(self, span: tuple[int, int], indices: Mapping[int, array[int]]) -> None:
        number = 0
        for channel, index in indices.items():
            self.counts[channel] = self.counts.get(channel, 0) + len(index) // 2
            number += len(index) // 2
        if number:
            self.first = min(self.first, span[0]) if self.messages else span[0]
            self.last = max(self.last, span[1])
        self.messages += number

    def _summary(self, start: int) -> bytes:
        statistics = Statistics(
            attachment_count=len(self._attachments),
            channel_count=len(self.channels),
            channel_message_counts=dict(self.counts),
            chunk_count=len(self._chunk_indices),
            message_count=self.messages,
            metadata_count=len(self._metadata),
            message_start_time=self.first,
            message_end_time=self.last,
            schema_count=len(self.schemas),
        )
        groups = (
            (Opcode.SCHEMA, b"".join(map(encode, self.schemas.values()))),
            (Opcode.CHANNEL, b"".join(map(encode, self.channels.values()))),
            (Opcode.STATISTICS, encode(statistics)),
            (Opcode.CHUNK_INDEX, b"".join(self._chunk_indices)),
            (Opcode.ATTACHMENT_INDEX, b"".join(map(encode, self._attachments))),
            (Opcode.METADATA_INDEX, b"".join(map(encode, self._metadata))),
        )
        content, offsets = b"", b""
        for opcode, group in groups:
            if group:
                place = start + len(content)
                offsets += encode(SummaryOffset(group_opcode=opcode, group_start=place, group_length=len(group)))
                content += group
        footer = struct.pack("<BQQQ", Opcode.FOOTER, 20, start, start + len(content))
        checksum = crc32(content + offsets + footer)
        return content + offsets + encode(Footer(start, start + len(content), checksum))

    def _append(self, *parts: bytes | memoryview) -> None:
        """Write all parts, or none."""
        size = self.size
        try:
            for part in parts:
                rest = memoryview(part)
                while rest:  # a nearly full disk takes a part of it
                    rest = rest[self._stream.write(rest) :]
                size += len(part)
        except OSError:
            self._stream.seek(self.size)
            self._stream.truncate()
            raise
        self.size = size


def encode(record: object) -> bytes:
    """Return a record as the file holds it."""
    builder = RecordBuilder()
    record.write(builder)  # type: ignore[attr-defined]  # the library has no types
    return bytes(builder.end())
