"""Pictures of a recording, decoded beside the components that are computed anew.

To decode a PNG takes as long as to find everything in it. OpenCV does so without Python's lock, so a thread that is two
pictures ahead takes it off the way wherever a second core is free.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tulip_ros import topics
from tulip_sim.recompute.heard import Heard
from tulip_vision.coded_picture import decode_picture
from tulip_vision.messages import picture_from_message

RAW, COMPRESSED = topics.CAMERA_IMAGE.name, topics.CAMERA_COMPRESSED.name
AHEAD = 2  # pictures


def decoded(heard: Heard) -> NDArray[np.uint8]:
    """Return the (height, width, 3) BGR picture of a recorded message, compressed or not.

    Raises:
        ValueError: if it is none.
    """
    if heard.picture is not None:
        return heard.picture.result()
    return picture_from_message(heard.message) if heard.name == RAW else _decompressed(heard.message)


def decoding_ahead(messages: Iterable[Heard]) -> Iterator[Heard]:
    """Yield messages as they come, with the decoding of compressed pictures begun some pictures before."""
    waiting: deque[Heard] = deque()
    pictures = 0
    with ThreadPoolExecutor(1, "pictures") as thread:
        for heard in messages:
            waiting.append(heard)
            if heard.name == COMPRESSED:
                heard.picture = thread.submit(_decompressed, heard.message)
                pictures += 1
            while waiting and (pictures > AHEAD or pictures == 0):
                first = waiting.popleft()
                pictures -= first.picture is not None
                yield first
        yield from waiting


def _decompressed(message: Any) -> NDArray[np.uint8]:
    return decode_picture(bytes(message.data))
