"""The walk test's speeds, changed step by step while answers are still on their way, by several faces at once."""

from __future__ import annotations

from collections import deque

from tulip_strategy.interface import UserCommand, UserRequest
from tulip_strategy.user_input import UserInputParameters

Velocity = tuple[float, float, float]
STEPS: Velocity = (0.05, 0.05, 0.1)  # [m/s], [m/s], [rad/s] of one press of a key
STANDING: Velocity = (0.0, 0.0, 0.0)
LONGEST = 100  # commands that are sent and not heard of, beyond which the oldest were lost


class Speeds:
    """The velocity that this face wants, which is the robot's as soon as nothing of its own is on its way.

    Attributes:
        wanted: Forward [m/s], left [m/s], turning rate [rad/s].
    """

    def __init__(self) -> None:
        """Begin with standing."""
        self.wanted = STANDING
        self._sent: deque[Velocity] = deque(maxlen=LONGEST)
        self._heard: UserCommand | None = None
        self._left = False  # this face wants something else, and has not heard it yet

    @property
    def in_walk_test(self) -> bool:
        """Whether the robot does the walk test, whoever has begun it, or will at once."""
        heard = self._heard is not None and self._heard.request is UserRequest.WALK_TEST
        return not self._left and (heard or bool(self._sent))

    def change(self, axis: int, sign: int) -> Velocity:
        """Go a step faster or slower, up to the limits of the walk test.

        Args:
            axis: 0 forward, 1 to the left, 2 turning to the left.
            sign: 1 for more, -1 for less.

        Returns:
            What to send.
        """
        values, limit = list(self.wanted), UserInputParameters.walk_test_limits[axis]
        steps = round(values[axis] / STEPS[axis]) + sign  # whole steps: no rounding adds up
        values[axis] = max(-limit, min(limit, round(steps * STEPS[axis], 6)))
        return self.send((values[0], values[1], values[2]))

    def send(self, velocity: Velocity) -> Velocity:
        """Note that a velocity is sent, and return it."""
        self.wanted, self._left = velocity, False
        self._sent.append(velocity)
        return velocity

    def forget(self) -> None:
        """Forget what is on its way, since a wish was refused: the robot's own velocity holds."""
        self._sent.clear()
        self.wanted = self._heard.velocity if self._heard is not None else STANDING

    def leave(self) -> None:
        """End the walk test here at once, since this face wants something else.

        Walking that is heard of until then was asked for before: no key may take it up again.
        """
        self.forget()
        self._left = True

    def hear(self, command: UserCommand) -> None:
        """Take the command that holds.

        One of this face's own says that those before it have arrived, too. Any other is another face's, or another
        wish: nothing of this face's walk test holds then.

        Args:
            command: As user input publishes it; hearing it again changes nothing.
        """
        if command == self._heard:
            return
        self._heard = command
        self._left &= command.request is UserRequest.WALK_TEST
        on_the_way = list(self._sent)
        self._sent.clear()
        if command.request is UserRequest.WALK_TEST and command.velocity in on_the_way:
            self._sent.extend(on_the_way[len(on_the_way) - on_the_way[::-1].index(command.velocity) :])
        if not self._sent:
            self.wanted = command.velocity
