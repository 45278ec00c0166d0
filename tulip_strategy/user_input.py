"""User input: checks what the user wants and keeps it until the next wish."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import dataclass

from tulip_strategy.interface import UserCommand, UserRequest

SIDES = ("left", "right")
_AXES = (("forward", "m/s"), ("left", "m/s"), ("turning", "rad/s"))


@dataclass(frozen=True)
class Wish:
    """What a person wants, as the arguments of `UserInput.ask`."""

    request: UserRequest
    strategy: str = ""
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    argument: str = ""


@dataclass(frozen=True)
class UserInputParameters:
    """What a user may ask for."""

    autostart: bool = False  # play as soon as the referee says so; else stand until the user starts
    strategy: str = "dribble_and_kick"  # until the user chooses another
    walk_test_limits: tuple[float, float, float] = (0.6, 0.2, 1.0)  # [m/s], [m/s], [rad/s] the gait was tested with
    walk_test_lifetime: float = 1.5  # [s] without a sign of who wanted it; bridges hiccups of a Wi-Fi

    def __post_init__(self) -> None:
        if not all(math.isfinite(limit) and limit > 0.0 for limit in self.walk_test_limits):
            raise ValueError(f"walk_test_limits is {self.walk_test_limits}; expected three finite numbers > 0")
        if not (math.isfinite(self.walk_test_lifetime) and self.walk_test_lifetime > 0.0):
            raise ValueError(f"walk_test_lifetime is {self.walk_test_lifetime} s; expected a finite number > 0")


class UserInput:
    """Keeps the user's last wish."""

    def __init__(self, parameters: UserInputParameters, strategies: Collection[str], stamp: int = 0) -> None:
        """Begin with STOP, or with PLAY where `autostart` is set.

        Args:
            parameters: See there.
            strategies: Names that PLAY can choose from.
            stamp: Of the first command [ns].

        Raises:
            ValueError: if the strategy to begin with is not one of them.
        """
        if parameters.strategy not in strategies:
            raise ValueError(f"strategy is {parameters.strategy!r}; expected one of: {', '.join(sorted(strategies))}")
        self._parameters = parameters
        self._strategies = strategies
        request = UserRequest.PLAY if parameters.autostart else UserRequest.STOP
        self._command = UserCommand(stamp, request, parameters.strategy)
        self._stopped = ""  # why an emergency stop holds

    def recall(self, command: UserCommand) -> None:
        """Go on with the wish that held when this program died."""
        if command.strategy in self._strategies:
            self._command = command

    @property
    def command(self) -> UserCommand:
        """The command that holds."""
        return self._command

    def stop(self, stamp: int, reason: str) -> None:
        """Want limp legs and nothing else until `release`, and limp legs after it until the next wish.

        Args:
            stamp: When [ns].
            reason: In words, not empty.
        """
        self.ask(stamp, UserRequest.LIMP)
        self._stopped = reason

    def release(self) -> None:
        """Take wishes again."""
        self._stopped = ""

    def ask(
        self,
        stamp: int,
        request: int,
        strategy: str = "",
        velocity: tuple[float, float, float] = (0.0, 0.0, 0.0),
        argument: str = "",
    ) -> str:
        """Take a wish.

        Args:
            stamp: When it came in [ns].
            request: Number of a `UserRequest`.
            strategy: For PLAY; "" keeps the present one.
            velocity: For WALK_TEST, of base_footprint in itself [m/s], [m/s], [rad/s].
            argument: For KICK_TEST: "left", "right" or "" for right.

        Returns:
            "" when it was taken, else why not; the old command holds then.
        """
        if request not in tuple(UserRequest):
            return f"request is {request}; expected 0 to {max(UserRequest).value}"
        wish = UserRequest(request)
        if self._stopped and wish is not UserRequest.LIMP:
            return f"{self._stopped}; release it first"
        refusal = ""
        if wish is UserRequest.PLAY and strategy and strategy not in self._strategies:
            refusal = f"strategy is {strategy!r}; expected one of: {', '.join(sorted(self._strategies))}"
        elif wish is UserRequest.WALK_TEST:
            refusal = self._check(velocity)
        elif wish is UserRequest.KICK_TEST and argument and argument not in SIDES:
            refusal = f"argument is {argument!r}; expected left or right"
        if refusal:
            return refusal
        walks, kicks = wish is UserRequest.WALK_TEST, wish is UserRequest.KICK_TEST
        self._command = UserCommand(
            stamp=stamp,
            request=wish,
            strategy=strategy if wish is UserRequest.PLAY and strategy else self._command.strategy,
            velocity=velocity if walks else (0.0, 0.0, 0.0),
            argument=(argument or "right") if kicks else "",
            sequence=self._command.sequence + 1,
        )
        return ""

    def end_walk_test(self, stamp: int) -> bool:
        """Stop and stand if a walk test goes on: whoever wanted it gives no sign any more.

        Args:
            stamp: When [ns].

        Returns:
            Whether one went on.
        """
        if self._command.request is not UserRequest.WALK_TEST:
            return False
        return not self.ask(stamp, UserRequest.STOP)

    def _check(self, velocity: tuple[float, float, float]) -> str:
        for (name, unit), value, limit in zip(_AXES, velocity, self._parameters.walk_test_limits, strict=True):
            if not abs(value) <= limit:  # also catches NaN
                return f"{name} velocity is {value} {unit}; expected -{limit} to {limit}"
        return ""
