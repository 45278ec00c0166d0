"""Penalty codes of each version. Codes that a version does not name count as a penalty of unknown kind."""

from __future__ import annotations

from collections.abc import Mapping

from tulip_strategy.interface import Penalty

Codes = Mapping[int, Penalty]

_2013: Codes = {
    0: Penalty.NONE,
    1: Penalty.BALL_MANIPULATION,
    2: Penalty.PHYSICAL_CONTACT,
    3: Penalty.ILLEGAL_ATTACK,
    4: Penalty.ILLEGAL_DEFENCE,
    5: Penalty.PICK_UP,
    6: Penalty.SERVICE,
    7: Penalty.PICK_UP_TO_SERVICE,
    14: Penalty.SUBSTITUTE,
    15: Penalty.MANUAL,
}

PENALTIES: dict[int, Codes] = {
    7: _2013,
    8: _2013,
    12: {
        0: Penalty.NONE,
        14: Penalty.SUBSTITUTE,
        15: Penalty.MANUAL,
        30: Penalty.BALL_MANIPULATION,
        31: Penalty.PHYSICAL_CONTACT,
        32: Penalty.ILLEGAL_ATTACK,
        33: Penalty.ILLEGAL_DEFENCE,
        34: Penalty.PICK_UP,  # or incapable
        35: Penalty.SERVICE,
        255: Penalty.UNKNOWN,
    },
    18: {
        0: Penalty.NONE,
        1: Penalty.BALL_MANIPULATION,
        2: Penalty.PHYSICAL_CONTACT,
        3: Penalty.ILLEGAL_MOTION,  # in set
        4: Penalty.INACTIVE,
        5: Penalty.ILLEGAL_POSITION,
        6: Penalty.LEFT_FIELD,
        7: Penalty.PICK_UP,
        8: Penalty.GAME_STUCK,
        9: Penalty.ILLEGAL_POSITION,  # in set
        10: Penalty.STANCE,
        11: Penalty.ILLEGAL_MOTION,  # in standby
        14: Penalty.SUBSTITUTE,
        15: Penalty.MANUAL,
    },
    19: {
        0: Penalty.NONE,
        1: Penalty.ILLEGAL_POSITION,
        2: Penalty.ILLEGAL_MOTION,  # in set
        3: Penalty.GAME_STUCK,
        4: Penalty.INACTIVE,
        5: Penalty.PICK_UP,
        6: Penalty.BALL_MANIPULATION,  # holding
        7: Penalty.LEFT_FIELD,
        8: Penalty.BALL_MANIPULATION,  # with arms or hands
        9: Penalty.PHYSICAL_CONTACT,
        10: Penalty.SENT_OFF,
        11: Penalty.SUBSTITUTE,
    },
    20: {
        0: Penalty.NONE,
        1: Penalty.ILLEGAL_POSITION,
        2: Penalty.ILLEGAL_MOTION,  # in set
        3: Penalty.ILLEGAL_MOTION,  # while the game is stopped
        4: Penalty.GAME_STUCK,
        5: Penalty.INACTIVE,
        6: Penalty.PICK_UP,
        7: Penalty.BALL_MANIPULATION,  # holding
        8: Penalty.LEFT_FIELD,
        9: Penalty.BALL_MANIPULATION,  # with arms or hands
        10: Penalty.PHYSICAL_CONTACT,
        11: Penalty.CAUTIONED,
        12: Penalty.SENT_OFF,
        13: Penalty.SUBSTITUTE,
    },
}
"""By version: what each code stands for."""


def penalty_of(version: int, code: int) -> Penalty:
    """Return what a code of a version stands for."""
    return PENALTIES[version].get(code, Penalty.UNKNOWN)


def code_of(version: int, *wanted: Penalty) -> int:
    """Return the code of the first of some penalties that a version has.

    Raises:
        ValueError: if it has none of them.
    """
    codes: dict[Penalty, int] = {}
    for code, penalty in PENALTIES[version].items():
        codes.setdefault(penalty, code)
    for penalty in wanted:
        if penalty in codes:
            return codes[penalty]
    raise ValueError(f"version {version} has no penalty {' or '.join(each.name for each in wanted)}")
