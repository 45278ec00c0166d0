"""Writes recordings until there is no room left; run in a process of its own."""

from __future__ import annotations

import contextlib
import os
import resource
import sys
from pathlib import Path

from rclpy.serialization import serialize_message
from std_msgs.msg import String

from tulip_ros import topics
from tulip_ros.bag import Bag


def fill(folder: Path, count: int = 3000) -> tuple[Bag, int, OSError | None]:
    """Write until the disk is full; return the recording, how many messages it took, and why it ended."""
    bag = Bag(folder, free=0)
    bag.note("recording", {"seed": "3"})
    bag.add_topic("/words", "std_msgs/msg/String", topics.STATE)
    try:
        for number in range(count):
            bag.write("/words", serialize_message(String(data=os.urandom(2000).hex())), number)
        bag.close()
    except OSError as error:
        with contextlib.suppress(OSError):
            bag.close()
        return bag, number, error
    return bag, count, None


if __name__ == "__main__":
    if len(sys.argv) > 2:
        resource.setrlimit(resource.RLIMIT_FSIZE, (int(sys.argv[2]), int(sys.argv[2])))
    bag, taken, error = fill(Path(sys.argv[1]))
    assert error is not None, "there was room for all"
    print(taken, bag.size(), error.strerror)
