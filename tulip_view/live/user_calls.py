"""What the page's buttons ask for: the services that the menu calls, too, and the simulator's push."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from rclpy.client import Client
from rclpy.node import Node
from rclpy.task import Future

from tulip_ros import topics
from tulip_ros.topics import Service
from tulip_strategy.menu import Wish

ANSWER = 5.0  # [s] of wall-clock time until a service must have answered
FIND = 1.0  # [s] until it must have been found: a node that has just started is not known at once
LOOK = 0.01  # [s] between two looks
Tell = Callable[[str], None]
"""Is told what came of a wish, in words."""


class UserCalls:
    """Clients of user input, recorder and simulator. Calls do not wait for answers, which are told when they come."""

    def __init__(self, node: Node, robot: str, tell: Tell) -> None:
        """Make the clients.

        Args:
            node: Has them; an executor serves it.
            robot: Namespace of the robot; "" for one that is alone.
            tell: Is told each answer.
        """
        self._tell = tell
        self._waiting: list[tuple[float, str, Client, Future]] = []

        def client(service: Service, namespace: str) -> Client:
            return node.create_client(service.type, f"/{namespace}/{service.name}".replace("//", "/"))

        self._wishes = client(topics.SET_USER_COMMAND, robot)
        self._pushes = client(topics.PUSH, robot)
        # A recorder of the robot's own, or one outside that records all robots.
        self._recorders = {
            service.name: [client(service, namespace) for namespace in dict.fromkeys((robot, ""))]
            for service in (topics.START_RECORDING, topics.STOP_RECORDING)
        }

    def wish(self, wish: Wish) -> None:
        """Tell the robot what the user wants."""
        request = topics.SET_USER_COMMAND.type.Request(
            request=wish.request.value, strategy=wish.strategy, velocity=list(wish.velocity), argument=wish.argument
        )
        self._ask(self._wishes, request, wish.request.name.lower().replace("_", " "), "node user_input does not run")

    def push(self, impulse: tuple[float, float, float]) -> None:
        """Push the simulated robot's trunk.

        Args:
            impulse: In map [N s].
        """
        request = topics.PUSH.type.Request(impulse=list(impulse))
        self._ask(self._pushes, request, "push", "no simulator of a single robot runs")

    def record(self, begin: bool) -> None:
        """Begin or end a recording."""
        service = topics.START_RECORDING if begin else topics.STOP_RECORDING
        what = "recording" if begin else "end of the recording"
        clients = self._recorders[service.name]
        ready = next((client for client in clients if client.service_is_ready()), clients[0])
        missing = "no recorder runs; start one in a terminal: python3 scripts/record.py --wait"
        self._ask(ready, service.type.Request(), what, missing)

    def check(self) -> None:
        """Give up those that have not answered in time; call it now and then."""
        now = time.monotonic()
        for entry in [entry for entry in self._waiting if entry[0] < now]:
            _, what, client, future = entry
            self._waiting.remove(entry)
            if not future.done():
                client.remove_pending_request(future)
                self._tell(f"{what}: no answer within {ANSWER:.0f} s; does the node still run?")

    def _ask(self, client: Client, request: Any, what: str, missing: str) -> None:
        end = time.monotonic() + FIND
        while not client.service_is_ready():
            if time.monotonic() > end:
                self._tell(f"{what}: {missing}")
                return
            time.sleep(LOOK)
        future = client.call_async(request)
        self._waiting.append((time.monotonic() + ANSWER, what, client, future))
        future.add_done_callback(lambda done: self._answered(what, done))

    def _answered(self, what: str, future: Future) -> None:
        answer = future.result()
        if answer is not None:
            taken = "taken" if answer.success else "refused"
            self._tell(f"{what}: {taken}" + (f" ({answer.message})" if answer.message else ""))
