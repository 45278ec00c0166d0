"""Pictures as PNG or JPEG, from files and recordings that anybody may have made.

OpenCV reads some twenty formats, and takes the memory that a picture's head asks for. So the head is looked at first:
the format must be one of these two, and the size one that a camera has.
"""

from __future__ import annotations

import struct

import cv2
import numpy as np
from numpy.typing import NDArray

PNG, JPEG = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"
LARGEST = 2**25  # pixels; 33 million
# Segments of a JPEG that tell its size: all "start of frame", C0 to CF but for three that are other things.
FRAMES = frozenset(range(0xC0, 0xD0)) - {0xC4, 0xC8, 0xCC}
ALONE = frozenset({0x01, *range(0xD0, 0xD9)})  # markers without a segment


def decode_picture(data: bytes) -> NDArray[np.uint8]:
    """Return (height, width, 3) BGR.

    Raises:
        ValueError: if it is neither PNG nor JPEG, is damaged so that nothing can be seen, or is too large.
    """
    try:
        width, height = _size(data)
    except (struct.error, IndexError):
        raise ValueError(f"{len(data)} bytes are no picture; expected JPEG or PNG") from None
    if not 1 <= width * height <= LARGEST:
        raise ValueError(f"the picture has {width} x {height} px; expected at most {LARGEST} in all")
    try:
        picture = cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_COLOR)
    except cv2.error as error:
        raise ValueError(f"the picture cannot be decoded: {' '.join(str(error).split())}") from error
    if picture is None:
        raise ValueError("the picture is damaged; expected JPEG or PNG")
    return np.asarray(picture, np.uint8)


def _size(data: bytes) -> tuple[int, int]:
    """Return width and height [px] as the head tells them; IndexError or struct.error if it tells none."""
    if data[:8] == PNG:
        if data[12:16] != b"IHDR":
            raise IndexError("the size does not come first")
        width, height = struct.unpack_from(">II", data, 16)
        return width, height
    if data[:3] != JPEG:
        raise IndexError("another format")
    place = 2
    while True:
        if data[place] != 0xFF:
            raise IndexError("no marker where one is due")
        marker = data[place + 1]
        if marker == 0xFF:  # filling
            place += 1
        elif marker in ALONE:
            place += 2
        elif marker in FRAMES:
            height, width = struct.unpack_from(">HH", data, place + 5)
            return width, height
        else:
            place += 2 + struct.unpack_from(">H", data, place + 2)[0]
