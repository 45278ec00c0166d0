"""Pictures as files and recordings hold them."""

from __future__ import annotations

import struct
import zlib

import cv2
import numpy as np
import pytest

from tulip_vision.coded_picture import JPEG, PNG, decode_picture

PICTURE = np.random.default_rng(1).integers(0, 256, (24, 32, 3)).astype(np.uint8)


def coded(kind: str) -> bytes:
    return cv2.imencode(kind, PICTURE)[1].tobytes()


def test_png_comes_back_as_it_was_and_jpeg_in_its_size() -> None:
    np.testing.assert_array_equal(decode_picture(coded(".png")), PICTURE)
    assert decode_picture(coded(".jpg")).shape == PICTURE.shape


@pytest.mark.parametrize("data", [b"", PNG, JPEG, JPEG + b"\xff" * 50, coded(".bmp"), coded(".tiff"), coded(".webp")])
def test_other_formats_and_bare_heads_are_no_pictures(data: bytes) -> None:
    with pytest.raises(ValueError, match="are no picture"):
        decode_picture(data)


def test_a_size_that_no_camera_has_is_refused_before_memory_is_taken() -> None:
    head = b"IHDR" + struct.pack(">IIBBBBB", 2**15, 2**15, 8, 2, 0, 0, 0)
    huge = PNG + struct.pack(">I", 13) + head + struct.pack(">I", zlib.crc32(head)) + coded(".png")[33:]
    with pytest.raises(ValueError, match="32768 x 32768 px; expected at most"):
        decode_picture(huge)
    frame = coded(".jpg").index(b"\xff\xc0") + 5
    data = bytearray(coded(".jpg"))
    data[frame : frame + 4] = b"\xff\xff\xff\xff"
    with pytest.raises(ValueError, match="65535 x 65535 px; expected at most"):
        decode_picture(bytes(data))
