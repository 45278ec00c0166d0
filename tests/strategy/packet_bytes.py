"""Packets of every version, written with `struct` from the formats alone: the other side of the codec's tests."""

from __future__ import annotations

import struct

SIZES = {7: 116, 8: 158, 12: 688, 18: 118, 19: 198, 20: 158}
OWN, OTHER = 25, 12
CYAN, MAGENTA = 0, 1


def write(
    version: int,
    state: int,
    penalty: int = 0,
    seconds: int = 0,
    kicks_off: bool = True,
    own: int = OWN,
    other: int = OTHER,
) -> bytes:
    """A packet for the own team (magenta, second in the packet), whose player 1 has a penalty.

    Args:
        version: Of the protocol.
        state: Number of the game's state.
        penalty: Code of player 1 of the own team.
        seconds: Until unpenalised [s].
        kicks_off: Whether the own team has the kick-off.
        own, other: Numbers of the teams.
    """
    colour = MAGENTA if kicks_off else CYAN
    number = own if kicks_off else other
    if version == 7:
        head = struct.pack("<4sI6BHI", b"RGme", 7, 1, state, 1, colour, 1, CYAN, 0xFFFF, 142)
        teams = [
            struct.pack("<4B22H", other, CYAN, 1, 2, *[0] * 22),
            struct.pack("<4B22H", own, MAGENTA, 1, 3, penalty, seconds, *[0] * 20),
        ]
        return head + b"".join(teams)
    if version == 8:
        head = struct.pack("<4s8B3H", b"RGme", 8, 77, 1, state, 1, colour, 1, CYAN, 0xFFFF, 142, 30)
        teams = [
            struct.pack("<4BH40sBB22B", other, CYAN, 2, 4, 5, b"wait", 0, 0, *[0] * 22),
            struct.pack("<4BH40sBB22B", own, MAGENTA, 3, 4, 5, b"\x01\0kick", 9, 8, penalty, seconds, *[0] * 20),
        ]
        return head + b"".join(teams)
    if version == 12:
        head = struct.pack(
            "<4sH7B4sB3H", b"RGme", 12, 77, 1, 1, state, 1, number, 1, b"\0\0\0\0", other, 0xFFFF, 142, 30
        )
        keeper = [0, 0, 0, 0, 0, 1]
        teams = [
            struct.pack("<4BHB253s6B66B", other, CYAN, 2, 4, 5, 6, b"wait", *[0] * 72),
            struct.pack(
                "<4BHB253s6B66B", own, MAGENTA, 3, 4, 5, 6, bytes(range(253)), *range(6),
                penalty, seconds, 1, 0, 0, 0, *keeper, *[0] * 54,
            ),
        ]  # fmt: skip
        return head + b"".join(teams)
    head = struct.pack("<4s10B2h", b"RGme", version, 77, 1, 2, 0, 1, state, 0, 1, number, 142, 30)
    extra = {18: (), 19: (1, 2), 20: (3,)}[version]
    room = 20 * (2 + len(extra))
    mine = [penalty, seconds, *extra]
    teams = [
        struct.pack(f"<6BHH{room}B", other, CYAN, 3, 1, 2, 4, 5, 1200, *[0] * room),
        struct.pack(f"<6BHH{room}B", own, MAGENTA, 5, 2, 3, 4, 5, 1100, *mine, *[0] * (room - len(mine))),
    ]
    return head + b"".join(teams)
