"""Referee packets (GameController): a declarative codec and the 2013 reply.

Every protocol version is one `Layout`: tables of field names and `struct` letters. The names are those of
the attributes of `Packet`, `Team` and `Player`, so a further version is a further table. All versions carry
the magic `RGme` and the version number in byte 4, on which `decode` dispatches.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from tulip_strategy.interface import GamePhase

PACKET_MAGIC = b"RGme"
REPLY_MAGIC = b"RGrt"
REPLY_VERSION = 1  # of the 2013 reply
REFEREE_PORT = 3838  # UDP, packets in and (in 2013) replies out
_PREFIX = 5  # bytes needed to know the version: the magic and byte 4


class TeamColour(IntEnum):
    """Colour of a team's markers in protocol versions 7 and 8; kick-off may also be `DROP_BALL`."""

    CYAN = 0
    MAGENTA = 1
    DROP_BALL = 2


class Penalty(IntEnum):
    """Penalties of the humanoid league in version 7."""

    NONE = 0
    BALL_MANIPULATION = 1
    PHYSICAL_CONTACT = 2
    ILLEGAL_ATTACK = 3
    ILLEGAL_DEFENCE = 4
    PICKUP_REQUEST = 5
    SERVICE_REQUEST = 6
    PICKUP_TO_SERVICE = 7
    SUBSTITUTE = 14
    MANUAL = 15


class ReplyMessage(IntEnum):
    """What a robot tells the referee program."""

    PENALISE = 0
    UNPENALISE = 1
    ALIVE = 2


@dataclass(frozen=True)
class Rejected:
    """Bytes that are no usable packet.

    Attributes:
        reason: What was wrong and what was expected.
    """

    reason: str


@dataclass(frozen=True)
class Player:
    """One robot in a packet.

    Attributes:
        penalty: Code, 0 for none; see `Penalty`.
        seconds: Until unpenalised [s].
    """

    penalty: int = 0
    seconds: int = 0


@dataclass(frozen=True)
class Team:
    """One team in a packet.

    Attributes:
        number: The team's own number.
        colour: See `TeamColour`.
        goal_colour: Colour of the goal that the team defends (0 blue, 1 yellow).
        score: Goals.
        players: One entry a player number, from 1 on; as many as the version has.
    """

    number: int
    colour: int
    goal_colour: int
    score: int
    players: tuple[Player, ...]


@dataclass(frozen=True)
class Packet:
    """One referee packet, whatever its version.

    Attributes:
        version: Protocol version.
        players_per_team: Robots that may play.
        state: 0 to 4, see `GamePhase`.
        first_half: 1 in the first half, else 0.
        kick_off: Who has the kick-off: a team's colour in version 7, 2 for a drop ball.
        secondary_state: 0 normal, 1 penalty shoot, 2 overtime.
        drop_in_team: Colour of the team that caused the last drop in.
        drop_in_time: Seconds since the last drop in, -1 for none yet [s].
        seconds_remaining: Of the half; negative in extra time [s].
        teams: The two teams.
        penalty_shots: Per team, one bit a penalty shot, set where it scored.
        sub_time: Seconds of the present ready or set phase or time-out [s].
    """

    version: int
    players_per_team: int
    state: int
    first_half: int
    kick_off: int
    secondary_state: int
    drop_in_team: int
    drop_in_time: int
    seconds_remaining: int
    teams: tuple[Team, Team]
    penalty_shots: tuple[int, int] = (0, 0)
    sub_time: int = 0


Table = tuple[tuple[str, str], ...]
"""Names with their `struct` letters, in the order of the bytes."""


@dataclass(frozen=True)
class Layout:
    """The bytes of one protocol version, little-endian and packed.

    Attributes:
        version: Number in byte 4.
        head: Fields before the teams, after magic and version.
        version_letter: `struct` letter of the version field.
        team: Fields of a team before its players.
        player: Fields of a player.
        players: How many players each of the two teams has in the packet.
        tail: Fields after the teams.
    """

    version: int
    version_letter: str
    head: Table
    team: Table
    player: Table
    players: tuple[int, int]
    tail: Table

    @property
    def format(self) -> str:
        """The whole packet as a `struct` format."""
        team, player = _letters(self.team), _letters(self.player)
        teams = "".join(team + player * count for count in self.players)
        return "<4s" + self.version_letter + _letters(self.head) + teams + _letters(self.tail)

    @property
    def size(self) -> int:
        """Length of a packet in bytes."""
        return struct.calcsize(self.format)

    def unpack(self, data: bytes) -> Packet:
        """Read a packet of exactly `size` bytes."""
        values = list(struct.unpack(self.format, data))
        _, version = _take(values, 2)
        content = _named(self.head, values)
        teams = []
        for count in self.players:
            team = _named(self.team, values)
            players = tuple(Player(**_named(self.player, values)) for _ in range(count))
            teams.append(Team(**team, players=players))
        return Packet(version=version, teams=(teams[0], teams[1]), **content, **_named(self.tail, values))

    def pack(self, packet: Packet) -> bytes:
        """Write a packet.

        Raises:
            ValueError: if a value does not fit its field or a team has the wrong number of players.
        """
        values: list[Any] = [PACKET_MAGIC, packet.version, *_values(self.head, packet)]
        for team, count in zip(packet.teams, self.players, strict=True):
            if len(team.players) != count:
                raise ValueError(
                    f"team {team.number} has {len(team.players)} players; version {self.version} has {count}"
                )
            values += _values(self.team, team)
            for player in team.players:
                values += _values(self.player, player)
        values += _values(self.tail, packet)
        try:
            return struct.pack(self.format, *values)
        except struct.error as error:
            raise ValueError(f"packet does not fit version {self.version}: {error}") from error


def _letters(table: Table) -> str:
    return "".join(letter for _, letter in table)


def _take(values: list[Any], count: int) -> list[Any]:
    taken = values[:count]
    del values[:count]
    return taken


def _named(table: Table, values: list[Any]) -> dict[str, Any]:
    """Take a table's values off the front of a list; a pair such as "2B" becomes a tuple."""
    named: dict[str, Any] = {}
    for name, letter in table:
        count = int(letter[:-1] or 1)
        taken = _take(values, count)
        named[name] = taken[0] if count == 1 else tuple(taken)
    return named


def _values(table: Table, source: object) -> list[Any]:
    values: list[Any] = []
    for name, _ in table:
        value = getattr(source, name)
        values += value if isinstance(value, tuple) else [value]
    return values


VERSION_7 = Layout(  # RoboCup 2013
    version=7,
    version_letter="I",
    head=(
        ("players_per_team", "B"),
        ("state", "B"),
        ("first_half", "B"),
        ("kick_off", "B"),
        ("secondary_state", "B"),
        ("drop_in_team", "B"),
        ("drop_in_time", "h"),
        ("seconds_remaining", "i"),
    ),
    team=(("number", "B"), ("colour", "B"), ("goal_colour", "B"), ("score", "B")),
    player=(("penalty", "H"), ("seconds", "H")),
    # The referee program writes the tail over player 11 of the second team, who never plays in AdultSize.
    players=(11, 10),
    tail=(("penalty_shots", "2B"), ("sub_time", "h")),
)

LAYOUTS = {layout.version: layout for layout in (VERSION_7,)}


def decode(data: bytes) -> Packet | Rejected:
    """Read a referee packet; any bytes are allowed, none raises."""
    if len(data) < _PREFIX:
        return Rejected(f"packet is {len(data)} bytes long; expected at least {_PREFIX}")
    if data[:4] != PACKET_MAGIC:
        return Rejected(f"packet begins with {data[:4]!r}; expected {PACKET_MAGIC!r}")
    layout = LAYOUTS.get(data[4])
    known = ", ".join(str(version) for version in LAYOUTS)
    if layout is None:
        return Rejected(f"referee protocol version is {data[4]}; expected one of: {known}")
    if len(data) != layout.size:
        return Rejected(f"packet of version {layout.version} is {len(data)} bytes long; expected {layout.size}")
    packet = layout.unpack(data)
    if packet.version != layout.version:
        return Rejected(f"referee protocol version is {packet.version}; expected one of: {known}")
    if packet.state not in tuple(GamePhase):
        return Rejected(f"game state is {packet.state}; expected 0 to {max(GamePhase).value}")
    return packet


def encode(packet: Packet) -> bytes:
    """Write a referee packet in the version that it names.

    Raises:
        ValueError: if the version is not known or a value does not fit.
    """
    layout = LAYOUTS.get(packet.version)
    if layout is None:
        raise ValueError(f"version is {packet.version}; expected one of: {', '.join(map(str, LAYOUTS))}")
    return layout.pack(packet)


@dataclass(frozen=True)
class Reply:
    """What a robot sends back, in the form of 2013.

    Attributes:
        team: Team number.
        player: Player number, from 1 on.
        message: See `ReplyMessage`.
        version: Version of the reply.
    """

    team: int
    player: int
    message: ReplyMessage = ReplyMessage.ALIVE
    version: int = REPLY_VERSION


_REPLY = struct.Struct("<4sIHHI")


def encode_reply(reply: Reply) -> bytes:
    """Write a reply.

    Raises:
        ValueError: if a number does not fit its field.
    """
    try:
        return _REPLY.pack(REPLY_MAGIC, reply.version, reply.team, reply.player, int(reply.message))
    except struct.error as error:
        raise ValueError(f"reply does not fit its fields: {error}") from error


def decode_reply(data: bytes) -> Reply | Rejected:
    """Read a reply; any bytes are allowed, none raises."""
    if len(data) != _REPLY.size:
        return Rejected(f"reply is {len(data)} bytes long; expected {_REPLY.size}")
    magic, version, team, player, message = _REPLY.unpack(data)
    if magic != REPLY_MAGIC:
        return Rejected(f"reply begins with {magic!r}; expected {REPLY_MAGIC!r}")
    if version != REPLY_VERSION:
        return Rejected(f"reply version is {version}; expected {REPLY_VERSION}")
    if message not in tuple(ReplyMessage):
        return Rejected(f"reply message is {message}; expected 0 to {max(ReplyMessage).value}")
    return Reply(team, player, ReplyMessage(message), version)
