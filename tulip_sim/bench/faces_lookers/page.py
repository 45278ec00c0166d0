"""Looks by the page as a browser of a fast machine does: takes everything, answers at once, and draws nothing."""

from __future__ import annotations

from importlib import metadata

import msgspec.msgpack
import zstandard

from tulip_sim.bench.faces_lookers.looker import Tally, look
from tulip_sim.bench.faces_lookers.web_socket import connected

HEAD = 16  # [B] before the compressed part of a frame: its two sizes
CAMERA = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, 0.0, 3.0),
    "fov": 1.0,
    "near": 0.01,
    "far": 100.0,
    "image_height": 800,
    "image_width": 1400,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}
"""Without a camera one is no client yet."""
QUESTION, ANSWER = "LocalStorageGetItemRequestMessage", "LocalStorageGetItemResponseMessage"
"""By which the page finds how fast the browser is."""


def see(port: int, tally: Tally) -> None:
    """Take all that comes, for ever."""
    with connected(port, f"viser-v{metadata.version('viser')}") as socket:
        socket.send(msgspec.msgpack.encode(CAMERA))
        for frame in socket:
            assert isinstance(frame, bytes)
            size = int.from_bytes(frame[8:HEAD], "little")
            content = msgspec.msgpack.decode(zstandard.decompress(frame[HEAD : HEAD + size]))
            tally.count("page: changes [1/s]", len(content["messages"]))
            tally.count("page: frames [1/s]")
            tally.count("page: bytes [1/s]", len(frame))
            for message in content["messages"]:
                if message["type"] == QUESTION:
                    answer = {"type": ANSWER, "value": None, "error": None, "request_uuid": message["request_uuid"]}
                    socket.send(msgspec.msgpack.encode(answer))


if __name__ == "__main__":
    look(see)
