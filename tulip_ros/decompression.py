"""Unpacks the chunks of recordings, but never more than they say they hold, nor more than LARGEST.

A few kilobytes can unpack to gigabytes: so what comes out is limited before it is made, not measured afterwards.
"""

from __future__ import annotations

import lz4.frame
import zstandard
from isal.isal_zlib import crc32

LARGEST = 2**28  # [B] of a chunk's records; recorders begin a new chunk after 1 to 4 MiB
COMPRESSIONS = ("", "zstd", "lz4")


def unpacked(data: bytes, compression: str, size: int, checksum: int) -> bytes:
    """Return what a chunk holds.

    Args:
        data: Compressed.
        compression: One of COMPRESSIONS.
        size: Of what it holds, as it says [B].
        checksum: CRC-32 of what it holds, or 0 for none.

    Raises:
        ValueError: if it holds anything else, or more than LARGEST.
    """
    if size > LARGEST:
        raise ValueError(f"a chunk of {size} bytes is larger than any recorder writes; expected at most {LARGEST}")
    content = beginning(data, compression, size + 1)
    if len(content) != size:
        raise ValueError(f"a chunk holds {'more' if len(content) > size else 'less'} than the {size} bytes it should")
    if checksum and crc32(content) != checksum:
        raise ValueError("a chunk has another checksum than it should")
    return content


def beginning(data: bytes, compression: str, most: int) -> bytes:
    """Return what the beginning of a chunk holds that may be cut.

    Args:
        data: Compressed.
        compression: One of COMPRESSIONS.
        most: No more than that [B].

    Raises:
        ValueError: if it cannot be unpacked.
    """
    try:
        if compression == "zstd":
            return bytes(zstandard.ZstdDecompressor().stream_reader(data).read(most))
        if compression == "lz4":
            return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most))
    except (zstandard.ZstdError, RuntimeError, EOFError, MemoryError) as error:
        raise ValueError(f"a chunk cannot be unpacked: {error}") from error
    if compression:
        raise ValueError(f"compression is {compression!r}; expected zstd, lz4 or none")
    return data[:most]
