"""Messages of some topics of an MCAP file, in the order of time, several times faster than mcap's own reader.

That one makes an object of each message in a chunk, wanted or not, and sorts them through a heap. Most readers want
some topics of many: here what is not wanted is stepped over, and a chunk is sorted at once.
"""

from __future__ import annotations

import struct
from collections.abc import Collection, Iterator
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex
from mcap.summary import Summary

from tulip_ros.decompression import unpacked

RECORD = struct.Struct("<BQ")  # opcode and length
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
LATEST = 2**63 - 1  # [ns] in the year 2262; a later time is a damaged number
HELD = 2**30  # [B] of messages of chunks whose times overlap, which wait for their turn

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
        McapError: if a chunk is damaged, or more than HELD would have to wait.
        ValueError: if its data are.
    """
    indexes = sorted(
        (index for index in summary.chunk_indexes if _may_hold(index, channels, start, end)),
        key=lambda index: (index.message_start_time, index.chunk_start_offset),
    )
    waiting: list[tuple[int, int, int, Message]] = []  # log time, chunk, place, message
    held = 0
    for number, index in enumerate(indexes):
        for place, message in _wanted(_content(stream, index), channels):
            time = message[2]
            if (start is None or time >= start) and (end is None or time < end):
                waiting.append((time, index.chunk_start_offset, place, message))
                held += len(message[4])
        if held > HELD:
            raise McapError(f"the times of its chunks overlap, by more than {HELD} bytes of messages")
        waiting.sort()
        later = indexes[number + 1].message_start_time if number + 1 < len(indexes) else None
        ready = 0
        while ready < len(waiting) and (later is None or waiting[ready][0] < later):
            ready += 1
        for entry in waiting[:ready]:
            held -= len(entry[3][4])
            yield entry[3]
        del waiting[:ready]


def _may_hold(index: ChunkIndex, channels: Collection[int], start: int | None, end: int | None) -> bool:
    if (start is not None and index.message_end_time < start) or (end is not None and index.message_start_time >= end):
        return False
    # A chunk without an index of its messages may hold anything.
    return not index.message_index_offsets or any(number in channels for number in index.message_index_offsets)


def _content(stream: BinaryIO, index: ChunkIndex) -> bytes:
    """Return the records of a chunk."""
    stream.seek(index.chunk_start_offset)
    opcode, length = RECORD.unpack(stream.read(RECORD.size))
    if opcode != Opcode.CHUNK or length + RECORD.size != index.chunk_length:
        raise McapError(f"there is no chunk at byte {index.chunk_start_offset}, where the index has one")
    chunk = Chunk.read(ReadDataStream(stream))
    try:
        return unpacked(chunk.data, chunk.compression, chunk.uncompressed_size, chunk.uncompressed_crc)
    except ValueError as error:
        raise McapError(f"byte {index.chunk_start_offset}: {error}") from error


def _wanted(data: bytes, channels: Collection[int]) -> Iterator[tuple[int, Message]]:
    """Yield the messages of some channels in a chunk, each with its place in it."""
    place, size = 0, len(data)
    while place < size:
        body = place + RECORD.size
        opcode, length = RECORD.unpack_from(data, place) if body <= size else (0, size)
        if body + length > size:
            raise McapError("a chunk ends in the middle of a record")
        if opcode == Opcode.MESSAGE:
            if length < MESSAGE.size:
                raise McapError(f"a message is {length} bytes long; expected at least {MESSAGE.size}")
            channel, sequence, log_time, published = MESSAGE.unpack_from(data, body)
            if log_time > LATEST or published > LATEST:
                raise McapError(f"a message is of {max(log_time, published)} ns; expected at most {LATEST} ns")
            if channel in channels:
                yield place, (channel, sequence, log_time, published, data[body + MESSAGE.size : body + length])
        place = body + length
