"""The robot's nodes in a game over real UDP sockets, in every version of the referee's protocol."""

from __future__ import annotations

import socket
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from kinematic_bench import motion_state, seen_object
from rclpy.executors import SingleThreadedExecutor

from tulip_description.planar import Pose2D
from tulip_motion.interface import MotionMode, WalkMode
from tulip_motion.messages import motion_state_to_message
from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.run import session
from tulip_sim.referee_packets import write_packet
from tulip_sim.referee_udp import RefereeSocket
from tulip_sim.situation import PlayerSituation, Removal, Situation, TeamSituation
from tulip_strategy.game_controller import LAYOUTS, Reply, TeamColour
from tulip_strategy.game_input_node import GameInputNode
from tulip_strategy.interface import GamePhase, Penalty, UserCommand, UserRequest
from tulip_strategy.messages import user_command_to_message
from tulip_strategy.strategy_node import StrategyNode
from tulip_worldmodel.messages import world_state_to_message
from tulip_worldmodel.world_state import RobotEstimate, WorldState

pytestmark = [pytest.mark.ros, pytest.mark.usefixtures("ros_domain")]

ROBOT = Pose2D(-1.5, 0.25, 0.1)
BALL = (0.5, 0.2)  # [m] in map
TICK = 0.03  # [s] of wall-clock time between world states
PATIENCE = 30.0  # [s] of wall-clock time until a test has failed


def free_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


class Game:
    """Game input and strategy as they run on the robot; legs and world model are played from here."""

    def __init__(self, node: GameInputNode, spin: Callable[[float], None], referee: RefereeSocket) -> None:
        self._spin, self._referee = spin, referee
        self._strategy = StrategyNode()
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(self._strategy)
        self._node = node
        self.mode = MotionMode.STAND
        self.tells_status = True
        self.decisions: list[Any] = []
        self.games: list[Any] = []
        self.replies: list[tuple[float, Any]] = []
        topics.DECISION.subscribe_from(self._strategy, self.decisions.append)
        topics.GAME_STATE.subscribe_from(self._strategy, self.games.append)
        self._worlds = topics.WORLD_STATE.publish_from(self._strategy)
        self._motions = topics.MOTION_STATE.publish_from(self._strategy)
        users = topics.USER_COMMAND.publish_from(self._strategy)
        users.publish(user_command_to_message(UserCommand(0, UserRequest.PLAY)))
        self._users = users

    def close(self) -> None:
        self._executor.shutdown()
        self._strategy.destroy_node()

    def until(self, holds: Callable[[], Any], sent: bytes = b"") -> None:
        """Let time pass until something holds; the referee sends a packet all the while, twice a second."""
        begin, next_packet = time.monotonic(), 0.0
        while not holds():
            now = time.monotonic()
            assert now - begin < PATIENCE, f"it did not come to hold; {[each.tree for each in self.decisions[-1:]]}"
            if sent and now >= next_packet:
                self._referee.send(sent)
                next_packet = now + 0.5
            if self.tells_status:
                self._tell()
            end = now + TICK
            while time.monotonic() < end:
                self._spin(0.005)
                self._executor.spin_once(timeout_sec=0.005)
            self.replies += [(time.monotonic(), reply) for reply in self._referee.replies()]

    def _tell(self) -> None:
        stamp = self._node.get_clock().now().nanoseconds
        self._motions.publish(motion_state_to_message(motion_state(stamp, self.mode), 0.0))
        robot = RobotEstimate(ROBOT, np.eye(3) * 0.01, ROBOT)
        ball = seen_object(ROBOT, BALL, (0.0, 0.0), age=0.25)
        self._worlds.publish(world_state_to_message(WorldState(stamp, robot, ball, ())))

    def decides(self, beginning: str, packet: bytes) -> Any:
        """Wait for a new decision whose path begins so, and return it."""
        count = len(self.decisions)
        path = f"robot > {beginning}"
        self.until(lambda: any(each.tree.startswith(path) for each in self.decisions[count:]), packet)
        return next(each for each in self.decisions[count:] if each.tree.startswith(path))


@contextmanager
def game_of(version: int, *parameters: str) -> Iterator[Game]:
    port, reply_port = free_port(), free_port() if version >= 12 else 0
    settings = [f"game_input:port:={port}", f"game_input:reply_port:={reply_port}"]
    settings += [f"game_input:{each}" for each in parameters]
    arguments = ["test", "--ros-args"] + [word for each in settings for word in ("-p", each)]
    with (
        RefereeSocket(port=port, reply_port=reply_port) as referee,
        session(GameInputNode, arguments) as (node, spin),
    ):
        game = Game(node, spin, referee)
        try:
            yield game
        finally:
            game.close()


def packet(version: int, phase: GamePhase, removal: Removal = Removal.NONE, seconds: int = 0) -> bytes:
    own = TeamSituation(25, TeamColour.CYAN, 1, (PlayerSituation(removal, seconds),))
    other = TeamSituation(12, TeamColour.MAGENTA, 0, (PlayerSituation(),))
    return write_packet(Situation(phase, True, 0, 120, 0, (own, other)), version)


@pytest.mark.parametrize("version", sorted(LAYOUTS))
def test_packets_take_the_robot_through_a_game(version: int) -> None:
    with game_of(version) as game:
        for phase in (GamePhase.INITIAL, GamePhase.READY, GamePhase.SET):
            decision = game.decides(phase.name.lower(), packet(version, phase))
            assert decision.walk.mode == WalkMode.STAND
        game.decides("playing", packet(version, GamePhase.PLAYING))
        game.until(lambda: game.decisions[-1].walk.mode == WalkMode.WALK, packet(version, GamePhase.PLAYING))
        assert game.decisions[-1].tree.startswith("robot > playing > plays dribble_and_kick")

        removed = packet(version, GamePhase.PLAYING, Removal.INACTIVE, 30)
        assert game.decides("penalised", removed).walk.mode == WalkMode.STAND
        assert Penalty(game.games[-1].penalty) in (Penalty.INACTIVE, Penalty.PICK_UP)
        assert game.games[-1].seconds_till_unpenalised == 30
        game.decides("playing", packet(version, GamePhase.PLAYING))
        decision = game.decides("finished", packet(version, GamePhase.FINISHED))
        assert decision.walk.mode == WalkMode.STAND

        assert {each.version for each in game.games} == {version}
        game.until(lambda: game.replies)
        for _, reply in game.replies:
            assert isinstance(reply, Reply)
            assert (reply.team, reply.player) == (25, 1)
            assert reply.version == {7: 1, 8: 2, 12: 2}.get(version, 4)


def test_replies_come_once_a_second_and_tell_where_the_robot_is_and_that_it_fell() -> None:
    with game_of(20) as game:
        playing = packet(20, GamePhase.PLAYING)
        game.tells_status = False
        game.until(lambda: len(game.games) >= 3, playing)
        assert game.replies == []  # not before it is known whether the robot stands
        game.tells_status = True
        game.until(lambda: len(game.replies) >= 4, playing)
        times = np.array([at for at, _ in game.replies])
        assert np.median(np.diff(times)) == pytest.approx(1.0, abs=0.2)  # looked at every 0.03 s, on a busy machine
        status = game.replies[0][1].status
        assert not status.fallen
        assert (status.pose.x, status.pose.y, status.pose.yaw) == pytest.approx((ROBOT.x, ROBOT.y, ROBOT.yaw), abs=1e-6)
        assert status.ball == pytest.approx(ROBOT.inverse().transform(BALL), abs=1e-6)
        assert status.ball_age == pytest.approx(0.25)
        game.mode = MotionMode.FALLEN
        count = len(game.replies)
        game.until(lambda: len(game.replies) >= count + 2, playing)
        assert game.replies[-1][1].status.fallen


@pytest.mark.parametrize("version", [19, 20])
def test_a_stopped_game_stops_the_robot_until_it_goes_on(version: int) -> None:
    with game_of(version) as game:
        playing = packet(version, GamePhase.PLAYING)
        game.until(lambda: game.decisions and game.decisions[-1].walk.mode == WalkMode.WALK, playing)
        stopped = playing[:8] + b"\1" + playing[9:]
        assert game.decides("halted", stopped).walk.mode == WalkMode.STAND
        game.decides("playing", playing)


def test_the_robot_plays_on_while_no_packets_come_and_the_state_is_stale() -> None:
    with game_of(20, "stale_after:=0.3") as game:
        game.decides("playing", packet(20, GamePhase.PLAYING))
        game.until(lambda: game.games[-1].stale)
        assert game.games[-1].phase == GamePhase.PLAYING
        game.decides("playing", b"")
        game.decides("set", packet(20, GamePhase.SET))
        assert not game.games[-1].stale


def test_packets_of_another_game_in_every_version_do_not_stop_the_robot() -> None:
    with game_of(7) as game:
        game.decides("playing", packet(7, GamePhase.PLAYING))
        count = len(game.games)
        for version in LAYOUTS:
            own = TeamSituation(3, TeamColour.CYAN, 0, (PlayerSituation(),))
            other = TeamSituation(4, TeamColour.MAGENTA, 0, (PlayerSituation(),))
            foreign = write_packet(Situation(GamePhase.FINISHED, True, 0, 120, 0, (own, other)), version)
            game.decides("playing", foreign)
        assert all(each.phase == GamePhase.PLAYING for each in game.games[count:])


def test_a_reply_port_in_use_is_named_by_the_system() -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        with pytest.raises(OSError, match="Address already in use"):
            RefereeSocket(reply_port=other.getsockname()[1])


@pytest.mark.parametrize(
    ("parameter", "words"),
    [
        ("team_number:=300", "team_number is 300; expected 0 to 255"),
        ("team_colour:=red", "game_input.team_colour is 'red'; expected one of any, cyan, magenta"),
        ("reply_port:=70000", "reply_port is 70000; expected 0 to 65535"),
        ("port:=0", "port is 0; expected 1 to 65535"),
    ],
)
def test_bad_parameters_of_game_input_are_named(parameter: str, words: str) -> None:
    with pytest.raises(BadInputError, match=words):
        with session(GameInputNode, ["test", "--ros-args", "-p", parameter]):
            pass
