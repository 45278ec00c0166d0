"""Finds everything that is whole in an MCAP file, however damaged the rest is."""

from __future__ import annotations

import re
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from mmap import mmap

from isal.isal_zlib import crc32
from mcap.opcode import Opcode

from tulip_ros.decompression import COMPRESSIONS, LARGEST, beginning, unpacked
from tulip_ros.log_chunks import LATEST

HEAD = struct.Struct("<BQ")  # opcode, length
CHUNK = struct.Struct("<QQQI")  # first and last log time, size and checksum of what it holds
MESSAGE = struct.Struct("<HIQQ")  # channel, sequence, log time, publish time
STRONG = (Opcode.SCHEMA, Opcode.CHANNEL, Opcode.CHUNK, Opcode.MESSAGE_INDEX, Opcode.ATTACHMENT, Opcode.METADATA)
"""Records whose parts must agree with their length, so that garbage is not taken for one."""
LENGTHS = {Opcode.DATA_END: 4, Opcode.FOOTER: 20, Opcode.SUMMARY_OFFSET: 17}
# Opcode, and a length below 2^40: where a record might begin. Overlapping ones count.
CANDIDATE = re.compile(rb"(?=[\x03\x04\x06\x07\x09\x0c][\s\S]{5}\x00\x00\x00)")
Data = bytes | mmap


@dataclass(frozen=True)
class Found:
    """A whole record, or a damaged stretch (opcode None).

    Attributes:
        opcode: What record it is.
        begin: Of the record, with its head [B].
        end: One after its last byte [B].
    """

    opcode: int | None
    begin: int
    end: int


@dataclass(frozen=True)
class ChunkHead:
    """What a chunk says about itself.

    Attributes:
        span: First and last log time [ns].
        size: Of its records before compression [B].
        checksum: CRC-32 of those, or 0.
        compression: "", "zstd" or "lz4".
        data: Where the compressed records begin in the file [B].
        length: Of the compressed records [B].
    """

    span: tuple[int, int]
    size: int
    checksum: int
    compression: str
    data: int
    length: int


def scan(data: Data, begin: int = 0) -> Iterator[Found]:
    """Yield whole records and damaged stretches in turn, from the beginning to the end of the file.

    Args:
        data: The file.
        begin: Where to begin, as in 8, after the magic bytes.
    """
    place, size = begin, len(data)
    while place < size:
        end = record_end(data, place, False)
        if end is None:
            following = _next(data, place + 1)
            yield Found(None, place, following)
            place = following
        else:
            opcode = data[place]
            yield Found(opcode, place, end)
            place = end
            if opcode == Opcode.FOOTER:
                return


def record_end(data: Data, place: int, strict: bool) -> int | None:
    """Return where the record at a place ends, or None if no whole record can be there.

    Args:
        data: The file.
        place: Where it would begin.
        strict: Allow only records that garbage is not taken for.
    """
    if place + HEAD.size > len(data):
        return None
    opcode, length = HEAD.unpack_from(data, place)
    begin, end = place + HEAD.size, place + HEAD.size + length
    if end > len(data) or not Opcode.HEADER <= opcode <= Opcode.DATA_END:
        return None
    if opcode not in STRONG:
        return None if strict or LENGTHS.get(opcode, length) != length else end
    try:
        return end if _fits(data, opcode, begin, end) else None
    except (struct.error, UnicodeDecodeError):
        return None


def chunk_head(data: Data, begin: int) -> ChunkHead | None:
    """Return what the chunk whose record begins at a place says about itself; None if that is cut or damaged."""
    place = begin + HEAD.size
    if data[begin : begin + 1] != bytes([Opcode.CHUNK]) or place + CHUNK.size + 4 > len(data):
        return None
    first, last, size, checksum = CHUNK.unpack_from(data, place)
    place += CHUNK.size
    (length,) = struct.unpack_from("<I", data, place)
    name = bytes(data[place + 4 : place + 4 + length]).decode("latin-1") if length <= 4 else "?"
    place += 4 + length
    if name not in COMPRESSIONS or size > LARGEST or place + 8 > len(data):
        return None
    (held,) = struct.unpack_from("<Q", data, place)
    return ChunkHead((first, last), size, checksum, name, place + 8, held)


def chunk_content(data: Data, head: ChunkHead) -> bytes | None:
    """Return a chunk's records, or None if they are not what was written."""
    try:
        return unpacked(_held(data, head), head.compression, head.size, head.checksum)
    except ValueError:
        return None


def cut_content(data: Data, head: ChunkHead) -> bytes:
    """Return the beginning of the records of a chunk that the end of the file cuts."""
    try:
        return beginning(_held(data, head), head.compression, head.size)
    except ValueError:
        return b""


def _held(data: Data, head: ChunkHead) -> bytes:
    return bytes(data[head.data : head.data + head.length])


def records(content: bytes) -> Iterator[tuple[int, int, int]]:
    """Yield opcode, begin and end of what each whole record in a chunk holds."""
    place, size = 0, len(content)
    while place + HEAD.size <= size:
        opcode, length = HEAD.unpack_from(content, place)
        place += HEAD.size
        if place + length > size:
            return
        yield opcode, place, place + length
        place += length


def message_head(content: bytes, begin: int, end: int) -> tuple[int, int, int, int] | None:
    """Return channel, sequence, log and publish time [ns] of a message; None if too short or of no possible time."""
    if end - begin < MESSAGE.size:
        return None
    channel, sequence, log_time, published = MESSAGE.unpack_from(content, begin)
    return None if max(log_time, published) > LATEST else (channel, sequence, log_time, published)


def _next(data: Data, begin: int) -> int:
    """Return where the next record begins that is surely one, or the end of the file."""
    for match in CANDIDATE.finditer(data, begin):
        if record_end(data, match.start(), True) is not None:
            return match.start()
    return len(data)


def _fits(data: Data, opcode: int, begin: int, end: int) -> bool:
    """Return whether the lengths inside a record agree with its own."""
    if opcode == Opcode.CHUNK:
        head = chunk_head(data, begin - HEAD.size)
        return head is not None and head.data + head.length == end
    if opcode == Opcode.MESSAGE_INDEX:
        (length,) = struct.unpack_from("<I", data, begin + 2)
        return bool(begin + 6 + length == end and length % 16 == 0)
    if opcode == Opcode.SCHEMA:
        place = _text(data, _text(data, begin + 2, end), end)
        return bool(place + 4 + struct.unpack_from("<I", data, place)[0] == end)
    if opcode == Opcode.CHANNEL:
        return _map(data, _text(data, _text(data, begin + 4, end), end), end) == end
    if opcode == Opcode.METADATA:
        return _map(data, _text(data, begin, end), end) == end
    place = _text(data, _text(data, begin + 16, end), end)  # an attachment
    (length,) = struct.unpack_from("<Q", data, place)
    if place + 8 + length + 4 != end:
        return False
    (checksum,) = struct.unpack_from("<I", data, end - 4)
    return checksum in (0, crc32(data[begin : end - 4]))


def _text(data: Data, place: int, end: int) -> int:
    """Return where a text ends that begins at a place."""
    (length,) = struct.unpack_from("<I", data, place)
    if place + 4 + length > end:
        raise struct.error("beyond the record")
    data[place + 4 : place + 4 + length].decode()
    return int(place + 4 + length)


def _map(data: Data, place: int, end: int) -> int:
    """Return where texts by text end that begin at a place."""
    (length,) = struct.unpack_from("<I", data, place)
    place += 4
    last = place + length
    if last > end:
        raise struct.error("beyond the record")
    while place < last:
        place = _text(data, _text(data, place, last), last)
    return int(place)
