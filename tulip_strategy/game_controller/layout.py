"""Packets as tables: names with their `struct` letters, and the values by those names.

A packet keeps every value of its bytes in one flat tuple, so that writing it gives the same bytes back, padding
included; names are looked up when somebody asks. That costs one call of `struct` a packet, whatever its size.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

Table = tuple[tuple[str, str], ...]
"""Names with their `struct` letters, in the order of the bytes; "4B" is a tuple of four, "40s" one bytes object."""

Places = Mapping[str, tuple[int, int]]
"""By name: index of the first value, and how many there are."""


@dataclass(frozen=True)
class Layout:
    """The bytes of one protocol version, little-endian and packed.

    Attributes:
        version: Number in byte 4.
        version_letter: `struct` letter of the version field.
        head: Fields before the teams, after magic and version.
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
    tail: Table = ()

    @cached_property
    def codec(self) -> struct.Struct:
        """The whole packet."""
        team, player = _letters(self.team), _letters(self.player)
        teams = "".join(team + player * count for count in self.players)
        return struct.Struct("<4s" + self.version_letter + _letters(self.head) + teams + _letters(self.tail))

    @property
    def size(self) -> int:
        """Length of a packet in bytes."""
        return self.codec.size

    @cached_property
    def team_starts(self) -> tuple[int, int]:
        """Index of the first value of each team."""
        first = 2 + _length(self.head)
        return first, first + _length(self.team) + self.players[0] * _length(self.player)

    @cached_property
    def places(self) -> Places:
        """Of the fields outside the teams."""
        tail = self.team_starts[1] + _length(self.team) + self.players[1] * _length(self.player)
        return {"magic": (0, 1), "version": (1, 1), **_places(self.head, 2), **_places(self.tail, tail)}

    @cached_property
    def team_places(self) -> Places:
        """Of a team's fields, counted from its first value."""
        return _places(self.team, 0)

    @cached_property
    def player_places(self) -> Places:
        """Of a player's fields, counted from its first value."""
        return _places(self.player, 0)

    def player_start(self, team: int, player: int) -> int:
        """Return the index of the first value of a player; both count from 0."""
        return self.team_starts[team] + _length(self.team) + player * _length(self.player)


class Record:
    """Named values; each name of the table is an attribute."""

    __slots__ = ("_places", "_start", "_values")

    def __init__(self, places: Places, values: tuple[Any, ...], start: int) -> None:
        self._places, self._values, self._start = places, values, start

    def __getattr__(self, name: str) -> Any:
        if name.startswith("_"):  # asked by copy before there are places to look into
            raise AttributeError(name)
        try:
            index, count = self._places[name]
        except KeyError:
            raise AttributeError(f"there is no {name!r} here; expected one of: {', '.join(self._places)}") from None
        index += self._start
        return self._values[index] if count == 1 else self._values[index : index + count]

    def fields(self) -> dict[str, Any]:
        """Return all values by name."""
        return {name: getattr(self, name) for name in self._places}


class Team(Record):
    """One team of a packet; its players are in `players`, from number 1 on."""

    __slots__ = ("_index", "_layout")

    def __init__(self, layout: Layout, values: tuple[Any, ...], index: int) -> None:
        super().__init__(layout.team_places, values, layout.team_starts[index])
        self._layout, self._index = layout, index

    @property
    def players(self) -> tuple[Record, ...]:
        """All players that the packet has room for."""
        return tuple(self.player(number) for number in range(1, self.player_count + 1))

    @property
    def player_count(self) -> int:
        """How many players the packet has room for."""
        return self._layout.players[self._index]

    def player(self, number: int) -> Record:
        """Return the player of a number, from 1 to `player_count`."""
        layout = self._layout
        return Record(layout.player_places, self._values, layout.player_start(self._index, number - 1))


class Packet(Record):
    """One referee packet; fields outside the teams are its attributes, as `layout` names them."""

    __slots__ = ("layout",)

    def __init__(self, layout: Layout, values: tuple[Any, ...]) -> None:
        """Name the values of a packet.

        Args:
            layout: Of its version.
            values: All of them, in the order of the bytes, from the magic on.
        """
        super().__init__(layout.places, values, 0)
        self.layout = layout

    @property
    def values(self) -> tuple[Any, ...]:
        """All values in the order of the bytes."""
        return self._values

    @property
    def teams(self) -> tuple[Team, Team]:
        """The two teams."""
        return Team(self.layout, self._values, 0), Team(self.layout, self._values, 1)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Packet) and self.layout is other.layout and self._values == other._values

    def __hash__(self) -> int:
        return hash(self._values)

    def __repr__(self) -> str:
        return f"Packet({self.layout.version}, {self.fields()})"


def make_packet(
    layout: Layout, magic: bytes, fields: Mapping[str, Any], teams: Sequence[Mapping[str, Any]] = ()
) -> Packet:
    """Return a packet of some values; all others are 0.

    Args:
        layout: Of its version.
        magic: First four bytes.
        fields: Values outside the teams by name.
        teams: Values of each team by name; "players" holds values of the first players by name.

    Raises:
        ValueError: if the layout has no such field or has room for fewer players, or if bytes are too long.
    """
    values: list[Any] = list(layout.codec.unpack(bytes(layout.size)))
    letters = {**dict(layout.head), **dict(layout.tail)}
    _fill(values, layout.places, letters, 0, {**fields, "magic": magic, "version": layout.version}, layout.version)
    for index, team in enumerate(teams):
        players = team.get("players", ())
        if len(players) > layout.players[index]:
            raise ValueError(f"there are {len(players)} players; version {layout.version} has {layout.players[index]}")
        own = {name: value for name, value in team.items() if name != "players"}
        _fill(values, layout.team_places, dict(layout.team), layout.team_starts[index], own, layout.version)
        for number, player in enumerate(players):
            start = layout.player_start(index, number)
            _fill(values, layout.player_places, dict(layout.player), start, player, layout.version)
    return Packet(layout, tuple(values))


def _fill(
    values: list[Any],
    places: Places,
    letters: Mapping[str, str],
    start: int,
    fields: Mapping[str, Any],
    version: int,
) -> None:
    for name, value in fields.items():
        if name not in places:
            raise ValueError(f"version {version} has no field {name!r}; expected one of: {', '.join(places)}")
        index, count = places[name]
        if isinstance(value, bytes) and name in letters:
            room = int(letters[name][:-1])
            if len(value) > room:
                raise ValueError(f"{name} is {len(value)} bytes long; version {version} has room for {room}")
            value = value.ljust(room, b"\0")
        items = [value] if count == 1 else list(value)
        if len(items) != count:
            raise ValueError(f"{name} has {len(items)} values; version {version} has {count}")
        values[start + index : start + index + count] = items


def _letters(table: Table) -> str:
    return "".join(letter for _, letter in table)


def _count(letter: str) -> int:
    return 1 if letter.endswith("s") else int(letter[:-1] or 1)


def _length(table: Table) -> int:
    return sum(_count(letter) for _, letter in table)


def _places(table: Table, start: int) -> dict[str, tuple[int, int]]:
    places: dict[str, tuple[int, int]] = {}
    for name, letter in table:
        places[name] = (start, _count(letter))
        start += _count(letter)
    return places
