"""Open a page that shows a running robot and steers it, or shows a recording of one."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare(("view",))

import signal
import socket
import sys
import threading
from pathlib import Path
from typing import Annotated

import typer
from _network import Network

from tulip_ros import network
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, require
from tulip_ros.plan import check_namespace
from tulip_ros.run import session
from tulip_view.live.beside import LIBRARY, PORT, address


def main(
    recording: Annotated[
        Path | None, typer.Argument(help="Folder or MCAP file of a recording; none: the robot that runs.")
    ] = None,
    port: Annotated[int, typer.Option(help="TCP port of the page.", min=1, max=65535)] = PORT,
    robot: Annotated[str | None, typer.Option(help="Namespace of the robot to begin with, as in striker.")] = None,
    lan: Annotated[
        bool, typer.Option("--lan", help="Let other computers open the page: all in the network can steer the robot.")
    ] = False,
    peers: Network = "",
) -> None:
    """Serve the page until Ctrl-C; open its address in a browser."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    try:
        require(*LIBRARY)
        if recording is not None and peers:
            raise BadInputError("--network is for a robot that runs; leave it out with a recording.")
        if recording is None:
            network.join(peers)
            show_running(check_namespace(robot or ""), port, lan)
        else:
            from tulip_view.live.view_log import show_recording

            show_recording(recording, robot, port, lan, lambda: tell(port, lan), threading.Event())
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    except KeyboardInterrupt:
        print("page closed")


def show_running(robot: str, port: int, lan: bool) -> None:
    """Serve the page of a running robot."""
    from tulip_view.live.view_node import ViewNode, ViewParameters

    settings = ViewParameters(port, lan, robot)
    with session(lambda: ViewNode(settings), arguments=[], handle_signals=False) as (node, spin):
        tell(port, lan)
        while True:
            node.advance(spin)


def tell(port: int, lan: bool) -> None:
    """Say where the page is, and who can open it."""
    print(f"open {address(port)} in a browser; Ctrl-C ends", flush=True)
    if lan:
        print(
            f"--lan: every computer in the network can open http://{socket.gethostname()}:{port} and command the robot;"
            " there is no password",
            flush=True,
        )


if __name__ == "__main__":
    typer.run(main)
