"""The menu in the terminal: watch a robot and steer it by keys, while its nodes run."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import sys
from typing import Annotated

import typer
from _network import Network

from tulip_ros import network
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
from tulip_ros.plan import check_namespace
from tulip_view.menu.app import Menu
from tulip_view.menu.robot_link import linked


def main(
    namespace: Annotated[str, typer.Option(help="Namespace of the robot, as in striker.")] = "",
    peers: Network = "",
) -> None:
    """Start, stop, walk test, kick test, push, record, identify, health of the nodes; key l is the emergency stop."""
    try:
        network.join(peers)
        with linked(check_namespace(namespace)) as robot:
            Menu(robot).run()
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None


if __name__ == "__main__":
    typer.run(main)
