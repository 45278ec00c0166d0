"""Lets a node play a recording: to the moment, with services for pause and step."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from rosgraph_msgs.msg import Clock

from tulip_ros import topics
from tulip_ros.log_file import Log, Record
from tulip_ros.replay import Passage, ReplayParameters, Schedule
from tulip_ros.run import ComponentNode
from tulip_ros.time import to_message

AHEAD = 2_000_000  # [ns] before a deadline from which nothing else is done: a callback takes less than that
LOOK = 0.02  # [s] longest time without a look at services
FASTER = 2.0  # by which the keys change the rate
Handler = Callable[[Record], None]
"""Publishes a recorded message."""


class Player:
    """Plays a passage through a node."""

    def __init__(
        self, node: ComponentNode, log: Log, handlers: Mapping[str, Handler], settings: ReplayParameters
    ) -> None:
        """Offer the services; `advance` plays.

        Args:
            node: Publishes.
            log: The recording.
            handlers: By full names of recorded topics.
            settings: What of it, and how.

        Raises:
            BadInputError: if nothing would be played.
        """
        self._node, self._handlers, self._settings = node, handlers, settings
        self.passage = Passage(log, handlers, settings.start, settings.duration)
        self._clock = node.sender(topics.CLOCK)
        for service, answer in (
            (topics.PAUSE_REPLAY, self._on_pause),
            (topics.RESUME_REPLAY, self._on_resume),
            (topics.STEP_REPLAY, self._on_step),
        ):
            node.create_service(service.type, service.name, answer)
        self.ended = False
        self.lateness: list[int] = []
        """By how much each message came later than it was due [ns]."""
        self.schedule: Schedule | None = None
        self._looked = 0.0

    def advance(self, spin: Callable[[float], None]) -> None:
        """Play the next message when it is due; or wait for it a little.

        Args:
            spin: Waits up to so many seconds [s] for messages and services, and handles them.
        """
        if self.schedule is None:
            self._begin()
        assert self.schedule is not None
        if self.ended:
            spin(LOOK)
            return
        log_time, record = self._next
        due, now = self.schedule.due(log_time), time.monotonic_ns()
        if due is None or due - now > AHEAD:
            wait = LOOK if due is None else min(LOOK, (due - now - AHEAD) * 1e-9)
            self._look(spin, wait)
            return
        if time.monotonic() - self._looked > LOOK:
            self._look(spin, 0.0)
            return
        if due > now:
            time.sleep((due - now) * 1e-9)  # to an absolute deadline of the steady clock, by the system
        if record is None:
            self._clock.publish(Clock(clock=to_message(log_time)))
        else:
            self._handlers[record.topic.name](record)
            self.lateness.append(time.monotonic_ns() - due)
        self._step_on()

    def pause(self) -> None:
        """Stand still."""
        if self.schedule is not None:
            self.schedule.pause(time.monotonic_ns())

    def resume(self) -> None:
        """Go on."""
        if self.schedule is not None:
            self.schedule.resume(time.monotonic_ns())

    def step(self) -> None:
        """Stand still, and let one step pass."""
        if self.schedule is not None:
            if not self.schedule.paused:
                self.pause()
            self.schedule.step(round(self._settings.step * 1e9))

    def key(self, pressed: str) -> None:
        """Obey a key: space pauses and resumes, s steps, + and - change the rate."""
        if self.schedule is None:
            return
        if pressed == " ":
            (self.resume if self.schedule.paused else self.pause)()
        elif pressed == "s":
            self.step()
        elif pressed in "+-":
            factor = FASTER if pressed == "+" else 1.0 / FASTER
            self.schedule.change_rate(self.schedule.rate * factor, time.monotonic_ns())

    def _begin(self) -> None:
        """Send what listeners would know at the passage's beginning, and wait for its first message."""
        for record in self.passage.before():
            self._handlers[record.topic.name](record)
        self._entries: Iterator[tuple[int, Record | None]] = iter(self.passage)
        now = time.monotonic_ns()
        # The first time there are listeners to be waited for; a loop goes on at once.
        delay = 0.0 if self.lateness else self._settings.delay
        paused = self._settings.paused if self.schedule is None else self.schedule.paused
        rate = self._settings.rate if self.schedule is None else self.schedule.rate
        self.schedule = Schedule(self.passage.first, rate, now + round(delay * 1e9))
        if paused:
            self.schedule.pause(now + round(delay * 1e9))
        self._step_on()

    def _step_on(self) -> None:
        try:
            self._next = next(self._entries)
        except StopIteration:
            if self._settings.loop and self.lateness:
                self._begin()
            else:
                self.ended = True

    def _look(self, spin: Callable[[float], None], wait: float) -> None:
        spin(wait)
        self._looked = time.monotonic()

    def _on_pause(self, request: Any, response: Any) -> Any:
        self.pause()
        return self._told(response)

    def _on_resume(self, request: Any, response: Any) -> Any:
        self.resume()
        return self._told(response)

    def _on_step(self, request: Any, response: Any) -> Any:
        self.step()
        return self._told(response)

    def _told(self, response: Any) -> Any:
        if self.schedule is None:
            response.success, response.message = False, "the replay has not begun"
            return response
        now = (self.schedule.position(time.monotonic_ns()) - self.passage.first) * 1e-9
        state = "ended" if self.ended else "paused" if self.schedule.paused else "playing"
        response.success, response.message = True, f"{state} at {now:.3f} s"
        return response
