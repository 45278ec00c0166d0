"""The text menu's connection to the robot: calls the services of user input and of the recorder."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from time import monotonic
from typing import Any

from rclpy.client import Client
from rclpy.node import Node
from rich.console import Console

from tulip_ros import topics
from tulip_ros.errors import BadInputError
from tulip_ros.run import session
from tulip_strategy.behaviour.tree import STRATEGIES
from tulip_strategy.menu import Menu, Wish

CONNECT = 10.0  # [s] of wall-clock time until user input must have been found
ANSWER = 5.0  # [s] of wall-clock time until it must have answered
LOOK = 0.1  # [s] between two looks


class MenuNode(Node):  # type: ignore[misc]  # rclpy comes without types
    """A client of user input and of the recorder."""

    def __init__(self) -> None:
        """Make the client; nothing waits yet."""
        super().__init__("menu")
        self._wishes = self.create_client(topics.SET_USER_COMMAND.type, topics.SET_USER_COMMAND.name)
        # Robots have namespaces; a recorder of their own, or one outside that records them all.
        self._recorders = {
            service.name: [self.create_client(service.type, name) for name in (service.name, f"/{service.name}")]
            for service in (topics.START_RECORDING, topics.STOP_RECORDING)
        }

    def connect(self, spin: Callable[[float], None]) -> None:
        """Wait for user input.

        Raises:
            BadInputError: if it is not there in time.
        """
        end = monotonic() + CONNECT
        while not self._wishes.service_is_ready():
            if monotonic() > end:
                raise BadInputError(
                    f"No node serves {self.resolve_service_name(topics.SET_USER_COMMAND.name)} within {CONNECT:.0f} s. "
                    "Start user_input (scripts/launch.py), in this namespace and with this ROS_DOMAIN_ID."
                )
            spin(LOOK)

    def send(self, wish: Wish, spin: Callable[[float], None]) -> tuple[bool, str]:
        """Pass a wish on; return whether it was taken, and a message."""
        request = topics.SET_USER_COMMAND.type.Request(
            request=wish.request.value, strategy=wish.strategy, velocity=list(wish.velocity), argument=wish.argument
        )
        return _ask(self._wishes, request, "user_input", spin)

    def record(self, begin: bool, spin: Callable[[float], None]) -> tuple[bool, str]:
        """Begin or end a recording; return whether that was done, and where it is or why not."""
        service = topics.START_RECORDING if begin else topics.STOP_RECORDING
        for client in self._recorders[service.name]:
            if client.service_is_ready():
                return _ask(client, service.type.Request(), "recorder", spin)
        return False, "no recorder runs here; start one in another terminal: python3 scripts/record.py --wait"


def _ask(client: Client, request: Any, server: str, spin: Callable[[float], None]) -> tuple[bool, str]:
    """Return whether a service did what it was asked for, and its message."""
    future = client.call_async(request)
    end = monotonic() + ANSWER
    while not future.done():
        if monotonic() > end:
            client.remove_pending_request(future)
            return False, f"{server} does not answer within {ANSWER:.0f} s; is it still running?"
        spin(LOOK)
    answer = future.result()
    return bool(answer.success), str(answer.message)


def main(arguments: Sequence[str] | None = None) -> None:
    """Connect to user input and show the menu until the user quits.

    Args:
        arguments: Command line with `--ros-args`, as in `-r __ns:=/striker`; the process's own by default.

    Raises:
        BadInputError: if user input is not there.
    """
    with session(MenuNode, arguments) as (node, spin):
        node.connect(spin)
        Menu(
            Console(),
            lambda wish: node.send(wish, spin),
            lambda begin: node.record(begin, spin),
            tuple(STRATEGIES),
        ).run()
