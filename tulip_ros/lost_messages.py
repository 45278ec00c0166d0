"""Counts messages that a publisher sent and a listener never got, from the numbers that the publishers give them."""

from __future__ import annotations

from collections.abc import Callable


class LostMessages:
    """Follows the numbers of one topic's messages.

    Each publisher numbers its messages 1, 2, 3 ...; whose a message is, is not known. So the number that follows one of
    those seen last goes on there. Any other belongs to a publisher that was not heard before, while there are more
    publishers than were heard; else messages are missing between.
    """

    def __init__(self) -> None:
        self.lost = 0
        """How many are missing so far."""
        self._last: list[int] = []  # number of each publisher's last message, the one heard last at the end

    def see(self, number: int, publishers: Callable[[], int]) -> int:
        """Take a message's number; return how many are missing since the one before it.

        Args:
            number: That its publisher gave it.
            publishers: Tells how many there are now; only asked when a number does not follow another one.
        """
        last = self._last
        if number - 1 in last:
            last.remove(number - 1)
            last.append(number)
            return 0
        known = max(1, publishers())
        before = [each for each in last if each < number]
        if not before or len(last) < known:
            if len(last) >= known:
                last.pop(0)  # of a publisher that is gone, or was started again
            last.append(number)
            return 0
        nearest = max(before)
        last.remove(nearest)
        last.append(number)
        missing = number - nearest - 1
        self.lost += missing
        return missing
