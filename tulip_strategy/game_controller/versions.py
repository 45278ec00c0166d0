"""The bytes of every version of the referee's packet that is known here.

| version | who sent it | bytes |
| --- | --- | --- |
| 7 | RoboCup 2013, all leagues | 116 |
| 8 | RoboCup 2014 | 158 |
| 12 | humanoid league to 2025 | 688 |
| 18 | standard platform league 2025 | 118 |
| 19 | humanoid soccer league, April 2026 | 198 |
| 20 | humanoid soccer league, July 2026 | 158 |

All begin with the magic `RGme` and carry their version in byte 4. Versions 8 and 20 have the same length.
"""

from __future__ import annotations

from enum import IntEnum

from tulip_strategy.game_controller.layout import Layout, Table

REFEREE_PORT = 3838  # UDP, where robots listen, in every version


class TeamColour(IntEnum):
    """Colour of a team: of its markers in versions 7 and 8 (cyan or magenta), of its shirts later."""

    ANY = -1
    """In parameters only: the colour does not matter."""
    CYAN = 0
    """Blue in later versions."""
    MAGENTA = 1
    """Red in later versions."""
    YELLOW = 2
    BLACK = 3
    WHITE = 4
    GREEN = 5
    ORANGE = 6
    PURPLE = 7
    BROWN = 8
    GRAY = 9


VERSION_7 = Layout(
    version=7,
    version_letter="I",
    head=(
        ("players_per_team", "B"),
        ("state", "B"),
        ("first_half", "B"),
        ("kick_off", "B"),  # a colour; 2 for a drop ball
        ("secondary_state", "B"),
        ("drop_in_team", "B"),
        ("drop_in_time", "h"),  # [s] -1 for none yet
        ("seconds_remaining", "i"),  # [s] negative in extra time
    ),
    team=(("number", "B"), ("colour", "B"), ("goal_colour", "B"), ("score", "B")),
    player=(("penalty", "H"), ("seconds", "H")),
    # The referee program writes the tail over player 11 of the second team, who never plays in AdultSize.
    players=(11, 10),
    tail=(("penalty_shots", "2B"), ("sub_time", "h")),
)

VERSION_8 = Layout(
    version=8,
    version_letter="B",
    head=(
        ("packet_number", "B"),
        ("players_per_team", "B"),
        ("state", "B"),
        ("first_half", "B"),
        ("kick_off", "B"),  # a colour; 2 for a drop ball
        ("secondary_state", "B"),
        ("drop_in_team", "B"),
        ("drop_in_time", "h"),
        ("seconds_remaining", "h"),
        ("secondary_time", "h"),
    ),
    team=(
        ("number", "B"),
        ("colour", "B"),
        ("score", "B"),
        ("penalty_shot", "B"),
        ("single_shots", "H"),
        ("coach_message", "40s"),
        ("coach_penalty", "B"),
        ("coach_seconds", "B"),
    ),
    player=(("penalty", "B"), ("seconds", "B")),
    players=(11, 11),
)

VERSION_12 = Layout(
    version=12,
    version_letter="H",
    head=(
        ("packet_number", "B"),
        ("players_per_team", "B"),
        ("game_type", "B"),
        ("state", "B"),
        ("first_half", "B"),
        ("kick_off", "B"),  # a team number; 255 for a drop ball
        ("secondary_state", "B"),
        ("secondary_info", "4B"),  # of a set play: the team that kicks, and how far it has come
        ("drop_in_team", "B"),
        ("drop_in_time", "h"),
        ("seconds_remaining", "h"),
        ("secondary_time", "h"),
    ),
    team=(
        ("number", "B"),
        ("colour", "B"),
        ("score", "B"),
        ("penalty_shot", "B"),
        ("single_shots", "H"),
        ("coach_sequence", "B"),
        ("coach_message", "253s"),
        ("coach_penalty", "B"),
        ("coach_seconds", "B"),
        ("coach_warnings", "B"),
        ("coach_yellow_cards", "B"),
        ("coach_red_cards", "B"),
        ("coach_goalkeeper", "B"),
    ),
    player=(
        ("penalty", "B"),
        ("seconds", "B"),
        ("warnings", "B"),
        ("yellow_cards", "B"),
        ("red_cards", "B"),
        ("goalkeeper", "B"),
    ),
    players=(11, 11),
)

_SHIRTED_TEAM: Table = (
    ("number", "B"),
    ("colour", "B"),
    ("goalkeeper_colour", "B"),
    ("goalkeeper", "B"),
    ("score", "B"),
    ("penalty_shot", "B"),
    ("single_shots", "H"),
    ("message_budget", "H"),
)
_COURSE: Table = (
    ("game_phase", "B"),
    ("state", "B"),
    ("set_play", "B"),
    ("first_half", "B"),
    ("kick_off", "B"),  # number of the team that has the kick-off or the set play; 255 for none
    ("seconds_remaining", "h"),
    ("secondary_time", "h"),
)

VERSION_18 = Layout(
    version=18,
    version_letter="B",
    head=(
        ("packet_number", "B"),
        ("players_per_team", "B"),
        ("competition_phase", "B"),
        ("competition_type", "B"),
        *_COURSE,
    ),
    team=_SHIRTED_TEAM,
    player=(("penalty", "B"), ("seconds", "B")),
    players=(20, 20),
)

_HUMANOID_SOCCER: Table = (
    ("packet_number", "B"),
    ("players_per_team", "B"),
    ("competition_type", "B"),
    ("stopped", "B"),
    *_COURSE,
)

VERSION_19 = Layout(
    version=19,
    version_letter="B",
    head=_HUMANOID_SOCCER,
    team=_SHIRTED_TEAM,
    player=(("penalty", "B"), ("seconds", "B"), ("warnings", "B"), ("cautions", "B")),
    players=(20, 20),
)

VERSION_20 = Layout(
    version=20,
    version_letter="B",
    head=_HUMANOID_SOCCER,
    team=_SHIRTED_TEAM,
    player=(("penalty", "B"), ("seconds", "B"), ("cautions", "B")),
    players=(20, 20),
)

LAYOUTS: dict[int, Layout] = {
    layout.version: layout for layout in (VERSION_7, VERSION_8, VERSION_12, VERSION_18, VERSION_19, VERSION_20)
}


def layout_of(version: int) -> Layout:
    """Return the layout of a version.

    Raises:
        ValueError: if it is not known.
    """
    if version not in LAYOUTS:
        raise ValueError(f"version is {version}; expected one of: {', '.join(map(str, LAYOUTS))}")
    return LAYOUTS[version]
