"""What can happen to messages on their way: lost, late, doubled, out of order. No ROS here."""

from __future__ import annotations

from collections import deque
from typing import Generic, TypeVar

import numpy as np

M = TypeVar("M")
KINDS = ("none", "lost", "late", "doubled", "out of order")


class Disturbance(Generic[M]):
    """The way of one topic's messages.

    Args:
        kind: One of KINDS.
        share: Of the messages that are lost, doubled or overtaken, by chance.
        hold: How many messages later a late one arrives, or one that is overtaken.
        rng: Of the chance.

    Raises:
        ValueError: for an unknown kind, a share that is none, or a hold that is not positive.
    """

    def __init__(self, kind: str, share: float, hold: int, rng: np.random.Generator) -> None:
        if kind not in KINDS:
            raise ValueError(f"kind is {kind!r}; expected one of {', '.join(KINDS)}")
        if not 0.0 <= share <= 1.0 or hold < 1:
            raise ValueError(f"share is {share}, hold is {hold}; expected 0 to 1, and >= 1")
        self._kind, self._share, self._hold, self._rng = kind, share, hold, rng
        self._late: deque[M] = deque()
        self._overtaken: list[tuple[int, M]] = []  # number of the message after which each is let go
        self._number = 0

    def pass_on(self, message: M) -> list[M]:
        """Return what arrives when a message is sent, in order."""
        self._number += 1
        if self._kind == "none":
            return [message]
        if self._kind == "late":
            self._late.append(message)
            return [self._late.popleft()] if len(self._late) > self._hold else []
        struck = bool(self._rng.random() < self._share)
        if self._kind == "lost":
            return [] if struck else [message]
        if self._kind == "doubled":
            return [message, message] if struck else [message]
        arrives = [] if struck else [message]
        arrives += [held for due, held in self._overtaken if due <= self._number]
        self._overtaken = [entry for entry in self._overtaken if entry[0] > self._number]
        if struck:
            self._overtaken.append((self._number + self._hold, message))
        return arrives
