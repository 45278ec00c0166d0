"""Game input: turns referee packets into the game as the own robot sees it. No sockets here."""

from __future__ import annotations

from dataclasses import dataclass, replace

from tulip_strategy.game_controller import (
    Packet,
    Rejected,
    Reply,
    ReplyMessage,
    Team,
    TeamColour,
    decode,
    encode_reply,
)
from tulip_strategy.interface import GamePhase, GameState


@dataclass(frozen=True)
class GameInputParameters:
    """Who we are, and how long a packet holds."""

    team_number: int = 25
    player_number: int = 1  # counted from 1, as on the robot's back
    team_colour: TeamColour | None = None  # picks one of two teams with the same number; None: the number alone does
    stale_after: float = 5.0  # [s] ten packets at 2 Hz lost in a row: the referee program or the network is gone

    def __post_init__(self) -> None:
        if not 0 <= self.team_number <= 255:
            raise ValueError(f"team_number is {self.team_number}; expected 0 to 255")
        if not 1 <= self.player_number <= 10:
            raise ValueError(f"player_number is {self.player_number}; expected 1 to 10")
        if not self.stale_after > 0.0:
            raise ValueError(f"stale_after is {self.stale_after} s; expected > 0")


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
        own = self._own_team(packet)
        if own is None:
            numbers = " and ".join(f"{team.number} (colour {team.colour})" for team in packet.teams)
            return Rejected(f"packet is for teams {numbers}; expected {self._who()}")
        if self._parameters.player_number > len(packet.teams[own].players):
            return Rejected(f"packet has no player {self._parameters.player_number}")
        self._state = self._seen_from(packet, own, stamp)
        return None

    def state(self, stamp: int) -> GameState | None:
        """Return the game's state at `stamp` [ns], or None before the first valid packet."""
        if self._state is None:
            return None
        stale = stamp - self._state.stamp > round(self._parameters.stale_after * 1e9)
        return replace(self._state, stale=stale)

    def reply(self, message: ReplyMessage = ReplyMessage.ALIVE) -> bytes:
        """Return the bytes to send back to the referee program."""
        return encode_reply(Reply(self._parameters.team_number, self._parameters.player_number, message))

    def _own_team(self, packet: Packet) -> int | None:
        for index, team in enumerate(packet.teams):
            if team.number == self._parameters.team_number and self._parameters.team_colour in (None, team.colour):
                return index
        return None

    def _who(self) -> str:
        colour = self._parameters.team_colour
        return f"{self._parameters.team_number}" + ("" if colour is None else f" (colour {colour.value})")

    def _seen_from(self, packet: Packet, own: int, stamp: int) -> GameState:
        team: Team = packet.teams[own]
        player = team.players[self._parameters.player_number - 1]
        return GameState(
            stamp=stamp,
            version=packet.version,
            phase=GamePhase(packet.state),
            first_half=bool(packet.first_half),
            kick_off=packet.kick_off == team.colour,
            secondary_state=packet.secondary_state,
            seconds_remaining=packet.seconds_remaining,
            own_score=team.score,
            opponent_score=packet.teams[1 - own].score,
            penalty=player.penalty,
            seconds_till_unpenalised=player.seconds,
        )
