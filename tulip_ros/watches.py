"""What a node needs to work: its inputs in time, and a time that goes on. No ROS here.

Both are looked at some times a second. Times are measured on two clocks: the wall clock, which goes on when a
simulation stalls, and the graph's time. An input is missed when both say so: a simulation that runs slower than the
wall clock makes its messages rare, not missing.
"""

from __future__ import annotations

from tulip_ros.finding import Finding, Level
from tulip_ros.timeline import JUMP

GRACE = 10.0  # [s] of wall-clock time for the other nodes to start: the slowest takes 5 s on two busy cores
STANDSTILL = 1.0  # [s] of wall-clock time without progress of the graph's time before somebody is told
LEAP = 5.0  # [s] further forward than the wall clock went: more than any simulation is faster between two looks
HOLD = 5.0  # [s] a jump of the clock stays told, so that a person sees it
ENOUGH = 5.0  # expected messages without which a share of lost ones says nothing
LOST = 0.2  # share of messages left out that counts as too slow
STALL = 1.5  # [s] of wall-clock time between two looks, after which a process was held up
DEAF = 5.0  # [s] without any message after that
SECOND = 1_000_000_000  # [ns]


class InputWatch:
    """Watches one topic that a node listens to."""

    def __init__(self, name: str, senders: tuple[str, ...], rate: float, missed_after: float, now: float) -> None:
        """Begin.

        Args:
            name: Of the topic.
            senders: Nodes that publish it, any of which will do.
            rate: How often it comes [1/s] in the graph's time; 0 for on events.
            missed_after: It is missed without a message for so long [s]; 0: never.
            now: Wall-clock time [s].
        """
        self.count = 0
        """Messages that came so far."""
        self.stamp = 0
        """Stamp of the newest of them [ns]; 0 where they carry none."""
        self.regular = rate > 0.0
        """Whether they come all the time."""
        self._served = (0.0, 0)  # sum [s] and number since they were last told
        self._name, self._senders = name, " or ".join(senders)
        self._rate, self._missed_after = rate, missed_after
        self._begun = now
        self._seen = 0
        self._since = (now, 0)  # wall clock [s] and graph's time [ns] of the last look that saw a new message
        self._before = (0, 0)  # count and stamp at the last tally

    def served(self, duration: float) -> None:
        """Take how long the node took over a message, with all that it sent for it [s]."""
        total, number = self._served
        self._served = (total + duration, number + 1)

    def latency(self) -> float | None:
        """Return the mean of what `served` was told since the last call [s]; None if nothing came."""
        (total, number), self._served = self._served, (0.0, 0)
        return total / number if number else None

    def begin_anew(self) -> None:
        """Forget stamps: time began anew."""
        self.stamp = 0
        self._before = (self.count, 0)

    def look(self, now: float, time: int) -> Finding | None:
        """Return what is missed.

        Args:
            now: Wall-clock time [s].
            time: The graph's time [ns].
        """
        if self.count != self._seen or time < self._since[1]:
            self._seen, self._since = self.count, (now, time)
            return None
        if not self._missed_after:
            return None
        if self.count == 0:
            late = now - self._begun > GRACE
            return Finding(Level.WARNING, f"no {self._name} has come yet: start {self._senders}") if late else None
        wall, graph = now - self._since[0], (time - self._since[1]) / SECOND
        if min(wall, graph) <= self._missed_after:
            return None
        return Finding(Level.ERROR, f"no {self._name} for {wall:.1f} s: look after {self._senders}")

    def tally(self) -> Finding | None:
        """Return whether too many messages were left out since the last call, by the stamps of those that came."""
        (count, stamp), self._before = self._before, (self.count, self.stamp)
        if not (self._rate and stamp and self.stamp):
            return None
        expected, came = (self.stamp - stamp) / SECOND * self._rate, self.count - count
        if expected < ENOUGH or came >= (1.0 - LOST) * expected:
            return None
        return Finding(
            Level.WARNING,
            f"takes {came} of {expected:.0f} {self._name}: this node or {self._senders} is too slow,"
            " free the processor for it",
        )


class TimeWatch:
    """Watches whether the graph's time goes on evenly."""

    def __init__(self, now: float) -> None:
        """Begin at a wall-clock time [s]."""
        self._begun = now
        self._last: tuple[float, int] | None = None  # wall clock [s] and graph's time [ns] of the last look
        self._moved = now
        self._jump = ""
        self._jumped_at = 0.0
        self.jumps = 0
        """How many there were."""

    def look(self, now: float, time: int) -> Finding | None:
        """Return what is wrong with the time, as for `InputWatch.look`."""
        if time == 0:
            self._last = None
            late = now - self._begun > GRACE
            words = "waits for time to begin" + (": start a driver, which sends /clock" if late else "")
            return Finding(Level.WARNING if late else Level.OK, words)
        if self._last is None or self._last[1] != time:
            self._moved = now
        if self._last is not None:
            wall, advance = now - self._last[0], (time - self._last[1]) / SECOND
            if advance < -JUMP / SECOND or advance > wall + LEAP:
                way = "back" if advance < 0.0 else "forward"
                self._jump = f"the clock jumped {way} by {abs(advance):.1f} s: everything begins anew"
                self._jumped_at = now
                self.jumps += 1
        self._last = (now, time)
        if now - self._moved > STANDSTILL:
            still = now - self._moved
            return Finding(
                Level.WARNING,
                f"time stands still for {still:.0f} s: look after the driver, or let the paused replay go on",
            )
        if self._jump and now - self._jumped_at < HOLD:
            return Finding(Level.WARNING, self._jump)
        return None


class StallWatch:
    """Tells that a node hears nobody any more since its process was held up.

    The others take a process that is silent for 20 s for dead. One that goes on at just that moment may never hear of
    it: then it knows all of them, and none of them sends to it.
    """

    def __init__(self, now: float) -> None:
        """Begin at a wall-clock time [s]."""
        self._last = now
        self._held_up: tuple[float, float, int] | None = None  # for so long [s], until when [s], messages by then

    def look(self, now: float, count: int) -> Finding | None:
        """Return whether the node hears nobody.

        Args:
            now: Wall-clock time [s].
            count: Messages that came so far, of inputs that come regularly.
        """
        gap, self._last = now - self._last, now
        if gap > STALL and count:
            self._held_up = (gap, now, count)
        if self._held_up is None:
            return None
        duration, since, before = self._held_up
        if count > before:
            self._held_up = None
        elif now - since > DEAF:
            return Finding(Level.ERROR, f"hears nobody since it was held up for {duration:.0f} s: start it again")
        return None
