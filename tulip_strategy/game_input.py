"""Game input: turns referee packets into the game as the own robot sees it. No sockets here."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tulip_strategy.game_controller import (
    Fault,
    Packet,
    Rejected,
    Reply,
    ReplyMessage,
    RobotStatus,
    TeamColour,
    decode,
    encode_reply,
)
from tulip_strategy.game_controller.layout import Team
from tulip_strategy.game_controller.meaning import MEANINGS
from tulip_strategy.game_controller.penalties import penalty_of
from tulip_strategy.game_controller.replies import ANSWERS, STATUS_VERSION
from tulip_strategy.interface import GameState


@dataclass(frozen=True)
class GameInputParameters:
    """Who we are, and how long a packet holds."""

    team_number: int = 25
    player_number: int = 1  # counted from 1, as on the robot's back
    team_colour: TeamColour = TeamColour.ANY  # picks one of two teams with the same number; any: the number alone does
    stale_after: float = 5.0  # [s] ten packets at 2 Hz lost in a row: the referee program or the network is gone

    def __post_init__(self) -> None:
        if not 0 <= self.team_number <= 255:
            raise ValueError(f"team_number is {self.team_number}; expected 0 to 255")
        if not 1 <= self.player_number <= 10:
            raise ValueError(f"player_number is {self.player_number}; expected 1 to 10")
        if not self.stale_after > 0.0:
            raise ValueError(f"stale_after is {self.stale_after} s; expected > 0")


@dataclass(frozen=True)
class Answer:
    """What to send back.

    Attributes:
        data: Bytes of the reply.
        port: UDP port at the referee that takes replies of this version.
    """

    data: bytes
    port: int


class GameInput:
    """Keeps the last valid packet and tells the game's state from it."""

    def __init__(self, parameters: GameInputParameters) -> None:
        self._parameters = parameters
        self._state: GameState | None = None

    def receive(self, data: bytes, stamp: int) -> Rejected | None:
        """Take a datagram that came in at `stamp` [ns].

        Returns:
            None when it was taken, else why not; the state is unchanged then.
        """
        packet = decode(data)
        if isinstance(packet, Rejected):
            return packet
        teams = packet.teams
        own = self._own_team(teams)
        if own is None:
            numbers = " and ".join(f"{team.number} (colour {team.colour})" for team in teams)
            return Rejected(Fault.TEAM, f"packet is for teams {numbers}; expected {self._who()}")
        self._state = self._seen_from(packet, teams[own], teams[1 - own], stamp)
        return None

    def state(self, stamp: int) -> GameState | None:
        """Return the game's state at `stamp` [ns], or None before the first valid packet."""
        if self._state is None:
            return None
        stale = stamp - self._state.stamp > round(self._parameters.stale_after * 1e9)
        return replace(self._state, stale=stale) if stale else self._state

    @property
    def needs_status(self) -> bool:
        """Whether the reply has to tell the robot's status."""
        return self._state is not None and ANSWERS[self._state.version][0] == STATUS_VERSION

    def answer(self, status: RobotStatus | None = None, message: ReplyMessage = ReplyMessage.ALIVE) -> Answer | None:
        """Return the reply that fits the last packet.

        Args:
            status: Of the robot, or None while it is not known.
            message: What to ask or say.

        Returns:
            None before the first valid packet, and while the reply needs a status that is not known: a robot that
            nobody knows to stand or lie must not be reported as either.
        """
        if self._state is None or (status is None and self.needs_status):
            return None
        version, port = ANSWERS[self._state.version]
        reply = Reply(self._parameters.team_number, self._parameters.player_number, message, version, status)
        return Answer(encode_reply(reply), port)

    def _own_team(self, teams: tuple[Team, Team]) -> int | None:
        for index, team in enumerate(teams):
            if team.number == self._parameters.team_number and self._parameters.team_colour in (
                TeamColour.ANY,
                team.colour,
            ):
                return index
        return None

    def _who(self) -> str:
        colour = self._parameters.team_colour
        return f"{self._parameters.team_number}" + ("" if colour is TeamColour.ANY else f" (colour {colour.value})")

    def _seen_from(self, packet: Packet, own: Team, other: Team, stamp: int) -> GameState:
        version = packet.layout.version
        meaning = MEANINGS[version]
        course = meaning.course(packet, own)
        player = own.player(self._parameters.player_number)
        return GameState(
            stamp=stamp,
            version=version,
            phase=meaning.phases[packet.state],
            first_half=bool(packet.first_half),
            kick_off=course.kick_off,
            secondary_state=course.secondary,
            seconds_remaining=packet.seconds_remaining,
            own_score=own.score,
            opponent_score=other.score,
            penalty=penalty_of(version, player.penalty),
            seconds_till_unpenalised=player.seconds,
            stopped=course.stopped,
            set_play=course.set_play,
            goalkeeper=meaning.goalkeeper(own),
        )
