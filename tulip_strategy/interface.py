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


class SecondaryState(IntEnum):
    """What kind of game is played."""

    NORMAL = 0
    PENALTY_SHOOT = 1
    OVERTIME = 2
    TIMEOUT = 3


class SetPlay(IntEnum):
    """How play begins again after an interruption."""

    NONE = 0
    GOAL_KICK = 1
    CORNER_KICK = 2
    THROW_IN = 3
    DIRECT_FREE_KICK = 4
    INDIRECT_FREE_KICK = 5
    PENALTY_KICK = 6


class Penalty(IntEnum):
    """Why a robot is out of play; up to MANUAL numbered as in 2013."""

    NONE = 0
    BALL_MANIPULATION = 1
    """Also holding the ball, and playing it with arms or hands."""
    PHYSICAL_CONTACT = 2
    """Pushing."""
    ILLEGAL_ATTACK = 3
    ILLEGAL_DEFENCE = 4
    PICK_UP = 5
    SERVICE = 6
    PICK_UP_TO_SERVICE = 7
    ILLEGAL_POSITION = 8
    ILLEGAL_MOTION = 9
    """It moved when robots have to stand still."""
    INACTIVE = 10
    """It fell and did not get up, or cannot play."""
    LEFT_FIELD = 11
    GAME_STUCK = 12
    CAUTIONED = 13
    SUBSTITUTE = 14
    """It does not take part at present."""
    MANUAL = 15
    SENT_OFF = 16
    STANCE = 17
    UNKNOWN = 255
    """A code that the protocol does not name: out of play all the same."""


@dataclass(frozen=True)
class GameState:
    """The game as the referee tells it, seen from the own team; the same whatever version of its protocol does.

    Attributes:
        stamp: When the packet came in [ns].
        version: Protocol version of the packet.
        phase: See `GamePhase`.
        first_half: Whether the first half is played.
        kick_off: Whether the own team has the kick-off, or the kick of the set play.
        secondary_state: See `SecondaryState`.
        seconds_remaining: Of the present half or trial [s].
        own_score, opponent_score: Goals.
        penalty: Why the own robot is out of play, NONE if it is not.
        seconds_till_unpenalised: [s].
        stale: No valid packet for more than 5 s; the rest is the last that was known.
        stopped: The referee has stopped the game: robots must not move, whatever the phase.
        set_play: See `SetPlay`.
        goalkeeper: Player number of the own team's goalkeeper, 0 where the packet does not tell.
    """

    stamp: int
    version: int
    phase: GamePhase
    first_half: bool
    kick_off: bool
    secondary_state: SecondaryState
    seconds_remaining: int
    own_score: int
    opponent_score: int
    penalty: Penalty
    seconds_till_unpenalised: int
    stale: bool = False
    stopped: bool = False
    set_play: SetPlay = SetPlay.NONE
    goalkeeper: int = 0

    @property
    def halted(self) -> bool:
        """Whether robots must not move although the phase would let them."""
        return self.stopped or self.secondary_state is SecondaryState.TIMEOUT


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
