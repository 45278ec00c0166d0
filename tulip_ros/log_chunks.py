"""Messages of some topics of an MCAP file, in the order of time, several times faster than mcap's own reader.

That one makes an object of each message in a chunk, wanted or not, and sorts them through a heap. Most readers want
some topics of many: here what is not wanted is stepped over, and a chunk is sorted at once.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from typing import BinaryIO

import lz4.frame
import zstandard
from isal.isal_zlib import crc32
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex
from mcap.summary import Summary

RECORD = struct.Struct("<BQ")  # opcode and length
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time

Message = tuple[int, int, int, int, bytes]
"""Channel, sequence, log time, publish time [ns] and serialized data."""


def messages_of(
    stream: BinaryIO, summary: Summary, channels: Collection[int], start: int | None, end: int | None
) -> Iterator[Message]:
    """Yield messages in the order of log times; those of the same time in the order of the file.

    Args:
        stream: The file.
        summary: Its index.
        channels: Numbers of the channels wanted.
        start: First log time wanted [ns], or None.
        end: First log time not wanted any more [ns], or None.

    Raises:
        McapError: if a chunk is damaged.
        ValueError: if its data are.
    """
    indexes = sorted(
        (index for index in summary.chunk_indexes if _may_hold(index, channels, start, end)),
        key=lambda index: (index.message_start_time, index.chunk_start_offset),
    )
    waiting: list[tuple[int, int, int, Message]] = []  # log time, chunk, place, message
    for number, index in enumerate(indexes):
        for place, message in _wanted(_content(stream, index), channels):
            time = message[2]
            if (start is None or time >= start) and (end is None or time < end):
                waiting.append((time, index.chunk_start_offset, place, message))
        waiting.sort()
        later = indexes[number + 1].message_start_time if number + 1 < len(indexes) else None
        ready = 0
        while ready < len(waiting) and (later is None or waiting[ready][0] < later):
            ready += 1
        for entry in waiting[:ready]:
            yield entry[3]
        del waiting[:ready]


def _may_hold(index: ChunkIndex, channels: Collection[int], start: int | None, end: int | None) -> bool:
    if (start is not None and index.message_end_time < start) or (end is not None and index.message_start_time >= end):
        return False
    # A chunk without an index of its messages may hold anything.
    return not index.message_index_offsets or any(number in channels for number in index.message_index_offsets)


def _content(stream: BinaryIO, index: ChunkIndex) -> bytes:
    """Return the records of a chunk."""
    stream.seek(index.chunk_start_offset + RECORD.size)
    chunk = Chunk.read(ReadDataStream(stream))
    size = chunk.uncompressed_size
    try:
        if chunk.compression == "zstd":
            data = zstandard.ZstdDecompressor().decompress(chunk.data, max_output_size=size)
        elif chunk.compression == "lz4":
            data = lz4.frame.decompress(chunk.data)
        elif chunk.compression == "":
            data = chunk.data
        else:
            raise McapError(f"compression {chunk.compression!r} is not known; expected zstd, lz4 or none")
    except (zstandard.ZstdError, RuntimeError) as error:
        raise McapError(f"a chunk cannot be decompressed: {error}") from error
    if chunk.uncompressed_crc and crc32(data) != chunk.uncompressed_crc:
        raise McapError(f"the chunk at byte {index.chunk_start_offset} has another checksum than it should")
    return bytes(data)


def _wanted(data: bytes, channels: Collection[int]) -> Iterator[tuple[int, Message]]:
    """Yield the messages of some channels in a chunk, each with its place in it."""
    place, size = 0, len(data)
    try:
        while place < size:
            opcode, length = RECORD.unpack_from(data, place)
            body = place + RECORD.size
            if opcode == Opcode.MESSAGE:
                channel, sequence, log_time, published = MESSAGE.unpack_from(data, body)
                if channel in channels:
                    yield place, (channel, sequence, log_time, published, data[body + MESSAGE.size : body + length])
            place = body + length
    except struct.error as error:
        raise McapError(f"a chunk ends in the middle of a record: {error}") from error
    if place != size:
        raise McapError("a chunk ends in the middle of a record")
