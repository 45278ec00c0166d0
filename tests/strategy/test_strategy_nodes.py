"""The nodes of strategy, game input and user input, in this process, with the other end beside them."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from kinematic_bench import game_state, motion_state, seen_object
from packet_bytes import write
from rclpy.action import ActionServer
from rclpy.action.client import ActionClient
from rclpy.node import Node

from tulip_description.planar import Pose2D
from tulip_motion.interface import HeadCommand, HeadMode, MotionMode, WalkCommand, WalkMode
from tulip_motion.messages import motion_state_to_message
from tulip_ros import topics
from tulip_ros.emergency_stop import StopLink
from tulip_ros.errors import BadInputError
from tulip_ros.finding import Level
from tulip_ros.run import session
from tulip_sim.referee_udp import RefereeSocket
from tulip_strategy.game_controller import Reply
from tulip_strategy.game_input_node import GameInputNode
from tulip_strategy.interface import Decision, UserCommand, UserRequest
from tulip_strategy.messages import (
    decision_to_message,
    game_state_from_message,
    game_state_to_message,
    user_command_from_message,
    user_command_to_message,
    world_state_from_message,
)
from tulip_strategy.strategy_node import StrategyNode
from tulip_strategy.user_input_node import UserInputNode
from tulip_worldmodel.messages import world_state_to_message
from tulip_worldmodel.world_state import RobotEstimate, WorldState

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]

ROBOT = Pose2D(1.0, 0.2, -0.2)


@contextmanager
def running(
    make_node: Callable[[], Node], *parameters: str
) -> Iterator[tuple[Node, Callable[[Callable[[], bool]], None]]]:
    """A node, and a function that spins until something holds."""
    arguments = ["test", "--ros-args"] + [word for parameter in parameters for word in ("-p", parameter)]
    with session(make_node, arguments) as (node, spin):

        def until(holds: Callable[[], bool]) -> None:
            for _ in range(1000):
                if holds():
                    return
                spin(0.05)
            raise AssertionError("it did not come to hold in 1000 looks")

        yield node, until


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def test_game_state_and_user_command_survive_the_messages() -> None:
    state = game_state(5 * 10**9, penalty=3)
    assert game_state_from_message(game_state_to_message(state)) == state
    command = UserCommand(7, UserRequest.WALK_TEST, "goalkeeper", (0.1, -0.2, 0.3), "left", 9)
    assert user_command_from_message(user_command_to_message(command)) == command


def test_a_decision_without_a_kick_says_so() -> None:
    decision = Decision(3, WalkCommand(3, WalkMode.STAND), HeadCommand(3, HeadMode.HOLD), None, "robot")
    message = decision_to_message(decision)
    assert not message.kick_requested
    assert message.tree == "robot"


def test_game_input_publishes_packets_answers_them_and_names_wrong_ones_once(
    capfd: pytest.CaptureFixture[str],
) -> None:
    port = free_port()
    with (
        running(GameInputNode, f"port:={port}", "stale_after:=600.0") as (node, until),
        RefereeSocket(port=port) as sent,
    ):
        states: list[Any] = []
        reports: list[Any] = []
        topics.GAME_STATE.subscribe_from(node, states.append)
        topics.DIAGNOSTICS.subscribe_from(node, reports.append)
        sent.send(write(7, 3))
        until(lambda: bool(states))
        assert (states[0].phase, states[0].own_score, states[0].stale) == (3, 3, False)
        replies: list[Any] = []
        until(lambda: bool(replies.extend(sent.replies()) or replies))
        assert replies == [Reply(25, 1)]

        def values(name: str) -> list[str]:
            return [value.value for report in reports for value in report.status[0].values if value.key == name]

        for wrong, fault, words in (
            (b"RGme\x0b" + bytes(683), "version", "version is 11; expected one of: 7, 8, 12, 18, 19, 20"),
            (write(20, 3)[:50], "size", "version 20 is 50 bytes long; expected 158"),
            (write(12, 3, own=24), "team", "packet is for teams 12 (colour 0) and 24 (colour 1); expected 25"),
        ):
            sent.send(wrong)
            until(lambda words=words: any(words in report.status[0].message for report in reports))
            for _ in range(20):
                sent.send(wrong)
            until(lambda fault=fault: "21" in values(f"rejected packets ({fault})"))
            assert capfd.readouterr().err.count(words) == 1  # in the log
        sent.send(write(7, 4))
        until(lambda: len(states) == 2)
        assert states[1].phase == 4


def test_game_input_says_when_the_referee_is_silent() -> None:
    port = free_port()
    with running(GameInputNode, f"port:={port}", "stale_after:=0.3") as (node, until), RefereeSocket(port=port) as sent:
        states: list[Any] = []
        topics.GAME_STATE.subscribe_from(node, states.append)
        sent.send(write(7, 3))
        until(lambda: len(states) == 2)
        assert [state.stale for state in states] == [False, True]


def test_a_referee_of_another_version_is_an_error_of_game_input_and_without_one_it_is_well() -> None:
    port = free_port()
    with running(GameInputNode, f"port:={port}") as (node, until), RefereeSocket(port=port) as sent:
        reports: list[Any] = []
        topics.DIAGNOSTICS.subscribe_from(node, lambda message: reports.append(message.status[0]))
        until(lambda: any(f"no packet from a referee yet on UDP {port}" in report.message for report in reports))
        assert all(report.level[0] == Level.OK for report in reports)
        sent.send(b"RGme\x0b" + bytes(683))
        until(lambda: reports[-1].level[0] == Level.ERROR)
        assert reports[-1].message.startswith("the referee is not understood, packets refused: ")
        assert "version is 11; expected one of: 7, 8" in reports[-1].message
        sent.send(write(7, 3))
        until(lambda: reports[-1].level[0] == Level.OK)


def test_a_port_in_use_is_an_error_that_names_port_and_remedy() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        port = other.getsockname()[1]
        with pytest.raises(BadInputError, match=rf"127.0.0.1:{port}: Address already in use.*set the parameters"):
            with running(GameInputNode, f"port:={port}"):
                pass


def test_user_input_takes_wishes_and_refuses_bad_ones() -> None:
    with running(UserInputNode) as (node, until):
        commands: list[Any] = []
        topics.USER_COMMAND.subscribe_from(node, commands.append)
        service = topics.SET_USER_COMMAND
        client = node.create_client(service.type, service.name)
        start = node.create_client(topics_trigger(), "start")
        until(lambda: client.service_is_ready() and start.service_is_ready() and bool(commands))
        assert commands[0].request == UserRequest.STOP
        answer = client.call_async(service.type.Request(request=UserRequest.KICK_TEST.value, argument="left"))
        until(answer.done)
        assert answer.result().success
        until(lambda: len(commands) == 2)
        assert (commands[1].request, commands[1].argument) == (UserRequest.KICK_TEST, "left")
        answer = client.call_async(service.type.Request(request=17))
        until(answer.done)
        assert not answer.result().success
        assert "request is 17" in answer.result().message
        answer = start.call_async(topics_trigger().Request())
        until(answer.done)
        until(lambda: len(commands) == 3)
        assert commands[2].request == UserRequest.PLAY


def test_a_walk_test_goes_on_while_its_user_gives_signs_and_ends_soon_after_the_last_one() -> None:
    with running(UserInputNode, "walk_test_lifetime:=1.0") as (node, until):
        commands: list[Any] = []
        topics.USER_COMMAND.subscribe_from(node, commands.append)
        wishes, signs = topics.USER_WISH.publish_from(node), topics.USER_PRESENT.publish_from(node)
        until(lambda: bool(commands) and wishes.get_subscription_count() == signs.get_subscription_count() == 1)
        wishes.publish(topics.USER_WISH.message(request=UserRequest.WALK_TEST.value, velocity=[0.1, 0.0, 0.0]))
        begin = time.monotonic()

        def goes_on() -> bool:
            signs.publish(topics.USER_PRESENT.message(data="face"))
            time.sleep(0.02)
            return time.monotonic() - begin > 2.0

        until(goes_on)
        assert [command.request for command in commands] == [UserRequest.STOP, UserRequest.WALK_TEST]
        last = time.monotonic()
        until(lambda: len(commands) == 3)
        assert commands[2].request == UserRequest.STOP
        assert time.monotonic() - last > 0.9
        signs.publish(topics.USER_PRESENT.message(data="face"))  # late ones bring nothing back
        until(lambda: time.monotonic() - last > 1.5)
        assert len(commands) == 3


def topics_trigger() -> Any:
    from std_srvs.srv import Trigger

    return Trigger


def world(stamp: int) -> WorldState:
    """The ball before the right foot, the keeper to the left."""
    ball = seen_object(ROBOT, ROBOT.transform((0.34, -0.12)), (0.1, 0.2), age=0.3)
    keeper = seen_object(ROBOT, (4.4, 0.5), (0.0, 0.0))
    robot = RobotEstimate(ROBOT, np.diag([0.1, 0.2, 0.3]), Pose2D(3.0, 2.0, 1.0) @ ROBOT)
    return WorldState(stamp, robot, ball, (keeper,))


def test_a_world_state_survives_the_messages() -> None:
    before = world(12)
    after = world_state_from_message(world_state_to_message(before))
    assert (after.stamp, after.robot.pose, after.robot.pose_in_odom) == (12, ROBOT, before.robot.pose_in_odom)
    assert after.robot.covariance.tolist() == before.robot.covariance.tolist()
    assert after.ball is not None
    assert before.ball is not None
    for old, new in ((before.ball, after.ball), (before.opponents[0], after.opponents[0])):
        for name in ("position", "velocity", "covariance", "position_in_map", "velocity_in_map", "age", "confidence"):
            assert np.array_equal(getattr(old, name), getattr(new, name)), name


def test_strategy_publishes_commands_and_sends_the_kick_as_an_action() -> None:
    with running(StrategyNode) as (node, until):
        goals: list[Any] = []
        decisions: list[Any] = []
        heads: list[Any] = []

        async def kick(handle: Any) -> Any:
            goals.append(handle.request)
            handle.succeed()
            return topics.KICK.type.Result(success=True)

        server = ActionServer(node, topics.KICK.type, topics.KICK.name, kick)
        client = ActionClient(node, topics.KICK.type, topics.KICK.name)
        topics.DECISION.subscribe_from(node, decisions.append)
        topics.HEAD_COMMAND.subscribe_from(node, heads.append)
        inputs = [
            topic.publish_from(node)
            for topic in (topics.WORLD_STATE, topics.GAME_STATE, topics.USER_COMMAND, topics.MOTION_STATE)
        ]
        until(lambda: all(publisher.get_subscription_count() for publisher in inputs) and client.server_is_ready())
        worlds, game, user, motion = inputs
        user.publish(user_command_to_message(UserCommand(0, UserRequest.PLAY)))
        game.publish(game_state_to_message(game_state(10**9)))
        motion.publish(motion_state_to_message(motion_state(10**9, MotionMode.STAND), 0.0))
        for tick in range(40):
            worlds.publish(world_state_to_message(world(10**9 + tick * 66_666_667)))
            until(lambda seen=tick: len(decisions) > seen)  # type: ignore[misc]
        until(lambda: bool(goals))
        assert len(goals) == 1
        assert goals[0].side == topics.KICK.type.Goal.RIGHT
        assert sum(decision.kick_requested for decision in decisions) == 1
        assert decisions[-1].tree == "robot > kick under way"
        assert heads[-1].mode == HeadMode.LOOK_AT
        client.destroy()
        server.destroy()


def test_strategy_wants_limp_legs_while_an_emergency_stop_holds_and_after_it_until_the_users_next_wish() -> None:
    with running(StrategyNode) as (node, until):
        walks: list[Any] = []
        topics.WALK_COMMAND.subscribe_from(node, walks.append)
        worlds, user = (topic.publish_from(node) for topic in (topics.WORLD_STATE, topics.USER_COMMAND))
        until(lambda: bool(worlds.get_subscription_count() and user.get_subscription_count()))
        stop = StopLink(node, "tester")

        def wish(request: UserRequest) -> None:
            user.publish(user_command_to_message(UserCommand(0, request, velocity=(0.2, 0.0, 0.0))))

        def until_mode(mode: WalkMode) -> None:
            """Let strategy decide until it wants that."""
            for tick in range(1000):
                seen = len(walks)
                worlds.publish(world_state_to_message(world(10**9 + tick * 20_000_000)))
                until(lambda seen=seen: len(walks) > seen)  # type: ignore[misc]
                if walks[-1].mode == mode:
                    return
            raise AssertionError(f"it did not come to want {mode.name}")

        wish(UserRequest.WALK_TEST)
        until_mode(WalkMode.WALK)
        stop.engage("a test")
        until_mode(WalkMode.LIMP)
        wish(UserRequest.WALK_TEST)  # of a user input that has not heard of the stop yet
        for _ in range(10):
            until_mode(WalkMode.LIMP)
        wish(UserRequest.LIMP)
        stop.release()
        for _ in range(10):
            until_mode(WalkMode.LIMP)
        wish(UserRequest.STAND)
        until_mode(WalkMode.STAND)
