"""What strategy takes beside the world state, and what it gives."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from tulip_motion.interface import HeadCommand, KickGoal, WalkCommand


class GamePhase(IntEnum):
    """State of the game, numbered as in the referee's packets."""

    INITIAL = 0
    READY = 1
    SET = 2
    PLAYING = 3
    FINISHED = 4


@dataclass(frozen=True)
class GameState:
    """The game as the referee tells it, seen from the own team.

    Attributes:
        stamp: When the packet came in [ns].
        version: Protocol version of the packet.
        phase: See `GamePhase`.
        first_half: Whether the first half is played.
        kick_off: Whether the own team has the kick-off.
        secondary_state: 0 normal, 1 penalty shoot, 2 overtime, 3 timeout.
        seconds_remaining: Of the present half or trial [s].
        own_score, opponent_score: Goals.
        penalty: The own robot's penalty code, 0 for none.
        seconds_till_unpenalised: [s].
        stale: No valid packet for more than 5 s; the rest is the last that was known.
    """

    stamp: int
    version: int
    phase: GamePhase
    first_half: bool
    kick_off: bool
    secondary_state: int
    seconds_remaining: int
    own_score: int
    opponent_score: int
    penalty: int
    seconds_till_unpenalised: int
    stale: bool = False


class UserRequest(IntEnum):
    """What the user wants."""

    PLAY = 0
    """Obey the referee and play `strategy`."""
    STOP = 1
    """Stop and stand, whatever the referee says."""
    STAND = 2
    WALK_TEST = 3
    """Walk with `velocity`."""
    KICK_TEST = 4
    """Kick once with the right (or, with "left" in `argument`, the left) foot."""
    LIMP = 5
    """Legs without stiffness."""


@dataclass(frozen=True)
class UserCommand:
    """The user's last wish; it holds until the next one.

    Attributes:
        stamp: [ns].
        request: See `UserRequest`.
        strategy: Name of the strategy for PLAY.
        velocity: (3,) for WALK_TEST: [m/s], [m/s], [rad/s].
        argument: Side for KICK_TEST: "left" or "right".
        sequence: Grows with each command, so that a second KICK_TEST is told from the first.
    """

    stamp: int
    request: UserRequest
    strategy: str = "dribble_and_kick"
    velocity: tuple[float, float, float] = (0.0, 0.0, 0.0)
    argument: str = ""
    sequence: int = 0


@dataclass(frozen=True)
class Decision:
    """What strategy wants at one instant.

    Attributes:
        stamp: Stamp of the newest input used [ns].
        walk: For motion control.
        head: For head movement.
        kick: A kick to start now, or None. Given once; the kick's progress comes back in MotionState.
        tree: The behaviour tree's active path, one name a level, for people to read.
    """

    stamp: int
    walk: WalkCommand
    head: HeadCommand
    kick: KickGoal | None
    tree: str
