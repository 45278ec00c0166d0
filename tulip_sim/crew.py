"""A team's people at their robot: they speak to it as people do, through services, and tell it where it stands."""

from __future__ import annotations

import time
from collections import deque
from typing import Any

from tulip_description.planar import Pose2D
from tulip_msgs.srv import SetUserCommand
from tulip_ros import topics
from tulip_sim.simulator_node import SimulatorNode, Spin
from tulip_strategy.interface import UserRequest
from tulip_worldmodel.messages import start_pose_to_message

PATIENCE = 0.05  # [s] of one wait for a service's answer
AGAIN = 5.0  # [s] of wall-clock time without an answer after which a wish is told again


class Crew:
    """A team's people at their robot."""

    def __init__(self, node: SimulatorNode, namespace: str) -> None:
        """Connect.

        Args:
            node: Owns the world.
            namespace: Of the robot's topics, below the node's own; "" for none.
        """
        self._node, self._namespace = node, namespace
        self._place = node.sender(topics.START_POSE.within(namespace))
        service = topics.SET_USER_COMMAND
        self._service = node.create_client(service.type, f"{namespace}/{service.name}" if namespace else service.name)
        self._wishes: deque[SetUserCommand.Request] = deque()
        self._answer: Any = None
        self._asked = 0.0

    def want(self, request: UserRequest, strategy: str = "") -> None:
        """Note a wish; it is told as soon as the one before was answered."""
        self._wishes.append(SetUserCommand.Request(request=request.value, strategy=strategy))

    def tell_place(self, pose: Pose2D) -> None:
        """Tell the robot where it stands, in its own map."""
        self._place.publish(start_pose_to_message(pose, self._node.world.stamp))

    def speak(self, spin: Spin, bound: float) -> None:
        """Tell what there is to tell, and hold the time for the answers; no longer than `bound` [s] of wall clock."""
        end = time.monotonic() + bound
        while self._wishes:
            now = time.monotonic()
            if self._answer is None and self._service.service_is_ready():
                self._answer, self._asked = self._service.call_async(self._wishes[0]), now
            elif self._answer is not None and self._answer.done():
                result = self._answer.result()
                if not result.success:
                    self._node.health.count(
                        "refused wishes", f"{self._namespace or 'the robot'} refuses: {result.message}"
                    )
                self._wishes.popleft()
                self._answer = None
                continue
            elif self._answer is not None and now - self._asked > AGAIN:
                self._answer = None  # the node was restarted meanwhile
            if now > end:
                return
            spin(PATIENCE)
