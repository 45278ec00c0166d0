"""What people ask for by buttons and keys reaches the robot in order, also when it is slow to answer."""

from __future__ import annotations

import time
from collections.abc import Iterator
from typing import Any, NamedTuple

import pytest
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from tulip_msgs.msg import UserCommand
from tulip_ros import asking, topics
from tulip_ros.asking import Asker
from tulip_ros.run import session
from tulip_strategy.interface import UserRequest
from tulip_strategy.user_input import Wish
from tulip_view.outcome import Outcome
from tulip_view.user_calls import PRESENCE, UserCalls

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]


class Slow(NamedTuple):
    """User input that answers when told to, and what was asked and told."""

    calls: UserCalls
    asked: list[tuple[int, float]]
    told: list[Outcome]
    spin: Any
    executor: SingleThreadedExecutor

    def answer(self, number: int) -> None:
        """Let it answer until so many outcomes were told."""
        while len(self.told) < number:
            self.executor.spin_once(0.02)
            self.spin(0.02)


@pytest.fixture
def slow() -> Iterator[Slow]:
    with session(lambda: Node("face"), ["test"], handle_signals=False) as (node, spin):
        server, executor, asked, told = Node("user_input"), SingleThreadedExecutor(), [], []

        def on_wish(request: Any, response: Any) -> Any:
            asked.append((request.request, float(request.velocity[0])))
            response.success = bool(request.velocity[0] < 0.5)
            response.message = "" if response.success else "too fast"
            return response

        server.create_service(topics.SET_USER_COMMAND.type, topics.SET_USER_COMMAND.name, on_wish)
        executor.add_node(server)
        calls = UserCalls(node, Asker(node), "face", "", told.append)
        while not calls.reaches_user_input:
            spin(0.05)
        yield Slow(calls, asked, told, spin, executor)
        executor.shutdown()
        server.destroy_node()


def walk(forward: float) -> Wish:
    return Wish(UserRequest.WALK_TEST, velocity=(forward, 0.0, 0.0))


def test_of_many_speeds_the_newest_follows_the_first(slow: Slow):
    for number in range(40):  # more than wait in the middleware
        slow.calls.wish(walk(number / 100))
    slow.answer(2)
    assert slow.asked == [(UserRequest.WALK_TEST, 0.0), (UserRequest.WALK_TEST, 0.39)]
    assert [str(outcome) for outcome in slow.told] == ["walk test: taken"] * 2


def test_limp_goes_out_at_once_and_no_speed_follows_it(slow: Slow):
    for number in range(40):
        slow.calls.wish(walk(number / 100))
    slow.calls.wish(Wish(UserRequest.LIMP))
    slow.answer(2)
    slow.calls.wish(walk(0.7))
    slow.answer(3)
    assert slow.asked == [(UserRequest.WALK_TEST, 0.0), (UserRequest.LIMP, 0.0), (UserRequest.WALK_TEST, 0.7)]
    assert str(slow.told[-1]) == "walk test: refused (too fast)"


def test_speeds_are_dropped_when_nobody_answers(slow: Slow, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(asking, "ANSWER", 0.3)
    slow.calls.wish(walk(0.1))
    slow.calls.wish(walk(0.2))
    while not slow.told:
        slow.spin(0.05)
    assert slow.told[0].verdict == "not done" and "does not answer" in slow.told[0].words
    monkeypatch.setattr(asking, "ANSWER", 60.0)
    slow.calls.wish(walk(0.3))
    slow.answer(2)
    assert [velocity for _, velocity in slow.asked] == [0.1, 0.3]  # the first was only late


def test_a_face_gives_signs_while_the_walk_test_that_it_began_holds_and_somebody_is_there(slow: Slow):
    signs: list[str] = []
    robot, ears = Node("robot"), Node("ears")
    commands = topics.USER_COMMAND.publish_from(robot)
    topics.USER_PRESENT.subscribe_from(ears, lambda message: signs.append(message.data))
    slow.executor.add_node(ears)
    there = [True]
    slow.calls._is_watched = lambda: there[0]

    def signs_come() -> bool:
        """Return whether one comes within four times the time between two."""
        signs.clear()
        end = time.monotonic() + 4.0 * PRESENCE
        while time.monotonic() < end:
            slow.spin(0.01)
            slow.executor.spin_once(0.01)
        return bool(signs)

    def command(request: int, forward: float = 0.0) -> None:
        commands.publish(UserCommand(request=request, velocity=[forward, 0.0, 0.0]))

    while not signs:  # until they find each other
        slow.calls._walk = [0.0, 0.0, 0.0]
        slow.spin(0.01)
        slow.executor.spin_once(0.01)
    assert signs[0] == "/face"
    slow.calls._walk = None
    assert not signs_come()
    slow.calls.wish(walk(0.3))
    slow.answer(1)
    command(UserCommand.WALK_TEST, 0.3)
    assert signs_come()
    there[0] = False
    assert not signs_come()
    there[0] = True
    command(UserCommand.WALK_TEST, 0.2)  # another face's
    assert not signs_come()
    for end in (lambda: command(UserCommand.STOP), lambda: slow.calls.wish(Wish(UserRequest.STAND))):
        told = len(slow.told)
        slow.calls.wish(walk(0.1))
        slow.answer(told + 1)
        assert signs_come()
        end()
        assert not signs_come()
    robot.destroy_node()
    ears.destroy_node()


def test_who_is_not_there_is_named_with_the_remedy(slow: Slow):
    slow.calls.record(True)
    slow.calls.push("forward", 4.0, 0.0)
    slow.calls.identify(True)
    for outcome, words in zip(slow.told, ("record.py --wait", "no simulator", "launch.py identify"), strict=True):
        assert outcome.verdict == "not done" and words in outcome.words
