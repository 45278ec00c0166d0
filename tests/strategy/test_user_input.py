from __future__ import annotations

import math

import pytest

from tulip_strategy.interface import UserCommand, UserRequest
from tulip_strategy.user_input import UserInput, UserInputParameters

STRATEGIES = ("dribble_and_kick", "goalkeeper")


def user_input() -> UserInput:
    return UserInput(UserInputParameters(), STRATEGIES)


def test_a_robot_stands_until_the_user_starts_it_unless_it_starts_by_itself() -> None:
    assert user_input().command.request is UserRequest.STOP
    assert UserInput(UserInputParameters(autostart=True), STRATEGIES).command.request is UserRequest.PLAY


def test_each_wish_replaces_the_last_and_counts_on() -> None:
    user = user_input()
    assert user.ask(5, UserRequest.WALK_TEST, velocity=(0.2, 0.0, -0.3)) == ""
    assert user.command == UserCommand(5, UserRequest.WALK_TEST, velocity=(0.2, 0.0, -0.3), sequence=1)
    assert user.ask(6, UserRequest.KICK_TEST) == ""
    assert user.command == UserCommand(6, UserRequest.KICK_TEST, argument="right", sequence=2)
    assert user.ask(7, UserRequest.KICK_TEST, argument="left") == ""
    assert user.command == UserCommand(7, UserRequest.KICK_TEST, argument="left", sequence=3)


def test_a_chosen_strategy_stays_chosen() -> None:
    user = user_input()
    user.ask(1, UserRequest.PLAY, strategy="goalkeeper")
    user.ask(2, UserRequest.STOP)
    user.ask(3, UserRequest.PLAY)
    assert user.command.strategy == "goalkeeper"


def test_while_an_emergency_stop_holds_nothing_but_limp_is_wanted_and_after_it_limp_still_is() -> None:
    user = user_input()
    user.ask(1, UserRequest.PLAY, strategy="goalkeeper")
    user.stop(2, "emergency stop by menu (key l)")
    assert user.command == UserCommand(2, UserRequest.LIMP, "goalkeeper", sequence=2)
    assert user.ask(3, UserRequest.PLAY) == "emergency stop by menu (key l); release it first"
    assert user.ask(3, UserRequest.LIMP) == ""
    user.release()
    assert user.command.request is UserRequest.LIMP
    assert user.ask(4, UserRequest.STAND) == "" and user.command.request is UserRequest.STAND


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"request": 6}, "request is 6; expected 0 to 5"),
        ({"request": -1}, "request is -1"),
        ({"request": 0, "strategy": "zone defence"}, "expected one of: dribble_and_kick, goalkeeper"),
        ({"request": 3, "velocity": (0.7, 0.0, 0.0)}, "forward velocity is 0.7 m/s; expected -0.6 to 0.6"),
        ({"request": 3, "velocity": (0.0, math.nan, 0.0)}, "left velocity is nan"),
        ({"request": 3, "velocity": (0.0, 0.0, -math.inf)}, "turning velocity is -inf rad/s"),
        ({"request": 4, "argument": "both"}, "argument is 'both'; expected left or right"),
    ],
)
def test_a_wish_that_cannot_be_is_refused_in_words_and_changes_nothing(
    arguments: dict[str, object], words: str
) -> None:
    user = user_input()
    before = user.command
    assert words in user.ask(1, **arguments)  # type: ignore[arg-type]
    assert user.command is before


def test_a_walk_test_that_nobody_is_there_for_ends_in_a_stop_and_nothing_else_does() -> None:
    user = user_input()
    user.ask(1, UserRequest.WALK_TEST, velocity=(0.2, 0.0, 0.0))
    assert user.end_walk_test(9)
    assert user.command == UserCommand(9, UserRequest.STOP, sequence=2)
    for request in (UserRequest.STOP, UserRequest.PLAY, UserRequest.STAND, UserRequest.KICK_TEST, UserRequest.LIMP):
        user.ask(10, request)
        before = user.command
        assert not user.end_walk_test(11)
        assert user.command is before


@pytest.mark.parametrize("lifetime", [0.0, -1.0, math.inf, math.nan])
def test_a_walk_test_lives_for_a_time_that_ends(lifetime: float) -> None:
    with pytest.raises(ValueError, match="walk_test_lifetime"):
        UserInputParameters(walk_test_lifetime=lifetime)


def test_an_unknown_first_strategy_is_named() -> None:
    with pytest.raises(ValueError, match="strategy is 'x'; expected one of: dribble_and_kick"):
        UserInput(UserInputParameters(strategy="x"), STRATEGIES)
