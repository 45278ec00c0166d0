"""The emergency stop as one node knows it: engaged by anybody, ended by an explicit release alone.

Everybody tells everybody, and repeats the newest word heard, so a node that was restarted learns it from any that
lives. Words may arrive late, twice or in any order: their numbers say which one counts. A number is greater than all
heard before and no less than the time of day [ns]; so a word of somebody who has heard nothing yet is new as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

GREATEST = 2**63
"""Number above which a word is of somebody who cannot count: nobody's time of day comes near, and more must follow."""


@dataclass(frozen=True)
class StopWord:
    """What somebody says of the emergency stop.

    Attributes:
        engaged: It holds; else it was released.
        by: Who asked for that, as in "menu".
        reason: In words for people.
        stamp: When, in the robot's time [ns]; 0 from somebody who does not know it.
        sequence: See above; 0 from somebody who cannot count: a stop then counts as new, a release as none.
    """

    engaged: bool = False
    by: str = ""
    reason: str = ""
    stamp: int = 0
    sequence: int = 0

    def __str__(self) -> str:
        what = "emergency stop" if self.engaged else "emergency stop released" if self.by else "no emergency stop"
        return what + (f" by {self.by}" if self.by else "") + (f" ({self.reason})" if self.reason else "")


class EmergencyStop:
    """Merges what was said.

    Example:
        >>> menu, driver = EmergencyStop(), EmergencyStop()
        >>> driver.hear(menu.engage("menu", "key l", now=1000), now=1001), driver.engaged
        (True, True)
    """

    def __init__(self) -> None:
        self._word = StopWord()
        self._released = 0  # number of the stop that an own release was meant for

    @property
    def word(self) -> StopWord:
        """What counts."""
        return self._word

    @property
    def engaged(self) -> bool:
        """Whether the emergency stop holds."""
        return self._word.engaged

    def hear(self, word: StopWord, now: int) -> bool:
        """Take what somebody says; return whether it changes what counts.

        Args:
            word: As it came.
            now: Time of day [ns].
        """
        newest = self._word.sequence
        if word.sequence > GREATEST:
            word = replace(word, sequence=0)
        if word.engaged and not self.engaged and (word.sequence == 0 or self._released < word.sequence < newest):
            # Somebody who cannot count; or a stop that was under way while it was released here: that was another one.
            word = replace(word, sequence=self._next(now))
        elif word.sequence < newest or (word.sequence == newest and not (word.engaged and not self.engaged)):
            return False
        self._word, self._released = word, word.sequence
        return True

    def engage(self, by: str, reason: str, stamp: int = 0, *, now: int) -> StopWord:
        """Begin an emergency stop, or confirm the one that holds; return the word to tell everybody.

        Args:
            by: Who asks.
            reason: In words.
            stamp: In the robot's time [ns].
            now: Time of day [ns].
        """
        self._word = StopWord(True, by, reason, stamp, self._next(now))
        self._released = self._word.sequence
        return self._word

    def release(self, by: str, stamp: int = 0, *, now: int) -> StopWord:
        """End the emergency stop; return the word to tell everybody. Arguments as for `engage`.

        Raises:
            ValueError: if none holds.
        """
        if not self.engaged:
            raise ValueError("no emergency stop holds: there is nothing to release")
        self._released = self._word.sequence
        self._word = StopWord(False, by, "", stamp, self._next(now))
        return self._word

    def _next(self, now: int) -> int:
        return max(self._word.sequence + 1, now)
