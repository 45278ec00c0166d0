"""The way of serialized messages into a scene: most are not needed, and are not decoded."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from tulip_ros.serialized import time_at
from tulip_ros.time import NANOSECONDS
from tulip_ros.timeline import Arrival, Timeline
from tulip_view.live.inputs import INPUTS
from tulip_view.live.scene import Scene
from tulip_view.recording import STEADY


class Intake:
    """Gives a scene the messages that it needs, as rarely as it needs them."""

    def __init__(self, scene: Scene) -> None:
        """Begin.

        Args:
            scene: Takes the messages.
        """
        self._scene = scene
        self.begin_anew()

    def begin_anew(self) -> None:
        """Forget which stamps came, and all that the scene holds."""
        self._scene.begin_anew()
        self._timeline = Timeline()
        self._last: dict[str, int] = {}

    def take(self, name: str, data: bytes, arrival: float, decode: Callable[[], Any]) -> None:
        """Pass a message on if the scene needs it.

        Args:
            name: Of its topic within the robot's namespace, one of `INPUTS`.
            data: The message, serialized; it begins with a header.
            arrival: When it came, by a clock that always runs forward [s].
            decode: Returns the message.
        """
        stamp = time_at(data)
        if name in STEADY:
            when = self._timeline.see(name, stamp)
            if when is Arrival.OLD:
                return
            if when is Arrival.ANEW:
                self._scene.begin_anew()
                self._last.clear()
        period = round(INPUTS[name].period * NANOSECONDS)
        if period and 0 <= stamp - self._last.get(name, -period) < period:
            return
        self._last[name] = stamp
        self._scene.take(name, decode(), arrival)
