"""The Kick action of node motion: done, refused and cancelled, by a client beside it; the body is simulated."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
import pytest
from action_msgs.msg import GoalStatus
from rclpy.action.client import ActionClient

from tulip_description.planar import Pose2D
from tulip_motion.messages import joint_command_from_message, sensors_to_messages
from tulip_motion.motion_node import MotionNode
from tulip_msgs.action import Kick
from tulip_ros import topics
from tulip_ros.run import session
from tulip_sim.scenario import Scenario
from tulip_sim.world import World

pytestmark = [pytest.mark.ros, pytest.mark.sim, pytest.mark.usefixtures("ros_domain")]


class Bench:
    """A node, a simulated body that answers it tick by tick, and a client of the action."""

    def __init__(self, node: MotionNode, spin: Callable[[float], None]) -> None:
        self._spin = spin
        self._world = World(Scenario(robot=Pose2D(), ball=(0.34, 0.12), poles=False), seed=1)
        self._commands: list[Any] = []
        self._answered = 0
        self.feedback: list[float] = []
        topics.LEG_COMMAND.subscribe_from(node, self._commands.append)
        self._inputs = [topic.publish_from(node) for topic in (topics.JOINT_STATES, topics.IMU, topics.FOOT_FORCES)]
        self.client = ActionClient(node, topics.KICK.type, topics.KICK.name)
        self.until(lambda: self.client.server_is_ready() and all(p.get_subscription_count() for p in self._inputs))

    def until(self, holds: Callable[[], bool]) -> None:
        for _ in range(500):
            if holds():
                return
            self._spin(0.02)
        raise AssertionError("it did not come to hold in 500 looks")

    def go(self, ticks: int) -> None:
        """Let the body and the node go on together."""
        cells = np.array([foot.cells for foot in self._world.robot.feet])
        for _ in range(ticks):
            for publisher, message in zip(self._inputs, sensors_to_messages(self._world.sensors(), cells), strict=True):
                publisher.publish(message)
            self._answered += 1
            self.until(lambda: len(self._commands) >= self._answered)
            assert self._world.apply(joint_command_from_message(self._commands[-1])) == ""
            self._world.advance(4)

    def send(self, **goal: Any) -> Any:
        """Send a goal; return its handle."""
        sent = self.client.send_goal_async(
            Kick.Goal(**goal), feedback_callback=lambda message: self.feedback.append(message.feedback.phase)
        )
        self.until(sent.done)
        return sent.result()

    def result_of(self, future: Any) -> Any:
        """Go on until the result is there."""
        for _ in range(60):
            if future.done():
                return future.result()
            self.go(20)
            self._spin(0.02)
        raise AssertionError("no result in 4.8 s of the body's time")


@contextmanager
def bench() -> Iterator[Bench]:
    with session(MotionNode, ["test"]) as (node, spin):
        made = Bench(node, spin)
        yield made
        made.client.destroy()


def test_a_kick_reports_its_phase_and_can_be_cancelled() -> None:
    with bench() as body:
        body.go(50)
        handle = body.send(side=Kick.Goal.LEFT, kind=Kick.Goal.FORWARD, speed=3.0)
        result = handle.get_result_async()
        body.go(100)  # the weight is shifted still
        body.until(lambda: bool(body.feedback))
        cancel = handle.cancel_goal_async()
        body.until(cancel.done)
        assert len(cancel.result().goals_canceling) == 1
        answer = body.result_of(result)
        assert answer.status == GoalStatus.STATUS_CANCELED
        assert (answer.result.success, answer.result.reason) == (False, "cancelled on request")
        assert body.feedback == sorted(body.feedback)


def test_a_kick_that_cannot_be_done_ends_with_the_reason() -> None:
    with bench() as body:
        body.go(50)
        handle = body.send(side=Kick.Goal.LEFT, kind=Kick.Goal.FORWARD, speed=3.0, has_ball=True, ball=[0.7, 0.0])
        answer = body.result_of(handle.get_result_async())
        assert answer.status == GoalStatus.STATUS_ABORTED
        assert "ball is at (0.70, 0.00) m, out of reach of the left foot" in answer.result.reason
