"""What a node keeps for the one that is started when it has died: where the robot is, what the user wanted.

The launcher holds a page of memory for each node, without a file, so that nothing is left when all have ended. A node
without a launcher keeps nothing.
"""

from __future__ import annotations

import contextlib
import json
import os
from collections.abc import Mapping
from typing import Any

VARIABLE = "TULIP_KEEPSAKE"
"""Environment variable that tells a node where its memory is."""
SIZE = 4096  # [B] one page: it is written in one piece, also by a process that is being killed


class Memory:
    """The launcher's end.

    Attributes:
        path: For the node's process.
    """

    def __init__(self, name: str) -> None:
        self._file = os.memfd_create(name)
        self.path = f"/proc/{os.getpid()}/fd/{self._file}"

    def close(self) -> None:
        """Forget it."""
        os.close(self._file)


class Keepsake:
    """The node's end."""

    def __init__(self) -> None:
        self._file: int | None = None
        path = os.environ.get(VARIABLE)
        if path is not None:
            with contextlib.suppress(OSError):  # the launcher was killed
                self._file = os.open(path, os.O_RDWR | os.O_CLOEXEC)

    def read(self) -> dict[str, Any]:
        """Return what the node of before has kept last; nothing for the first of its name."""
        text = b"" if self._file is None else os.pread(self._file, SIZE, 0)
        try:
            content = json.loads(text) if text else {}
        except ValueError:
            return {}
        return content if isinstance(content, dict) else {}

    def keep(self, values: Mapping[str, Any]) -> None:
        """Keep values for the next node of this name, in place of all that was kept before.

        Args:
            values: What JSON can hold.

        Raises:
            ValueError: if that is more than SIZE bytes.
        """
        if self._file is None:
            return
        text = json.dumps(values).encode()
        if len(text) > SIZE:
            raise ValueError(f"{len(text)} bytes are to be kept; expected at most {SIZE}")
        os.pwrite(self._file, text.ljust(SIZE), 0)
