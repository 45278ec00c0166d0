"""Show a running graph, or a replay, in Foxglove and viewers like it, until Ctrl-C."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare(("bridge",))

import sys
from typing import Annotated

import typer
from _network import Network

from tulip_ros import network
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, require
from tulip_ros.run import run
from tulip_view.bridge.settings import LAN, LAN_MEANS, LOOPBACK, PORT, BridgeParameters


def main(
    port: Annotated[int, typer.Option(help="Port to listen on; 0 for any that is free.")] = PORT,
    lan: Annotated[bool, typer.Option("--lan", help=f"Listen on all networks: {LAN_MEANS}")] = False,
    origin: Annotated[
        list[str] | None, typer.Option(help="Page that may connect, too, as in http://192.168.0.7:8080; repeatable.")
    ] = None,
    peers: Network = "",
) -> None:
    """Open a WebSocket for Foxglove: topics, services, parameters."""
    try:
        require("foxglove", "bridge")
        settings = BridgeParameters(LAN if lan else LOOPBACK, port, tuple(origin or ()))
        network.join(peers)
    except (BadInputError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    if lan:
        print(f"open to your networks: {LAN_MEANS}", flush=True)
    from tulip_view.bridge.bridge_node import BridgeNode

    run(lambda: BridgeNode(settings), arguments=[])


if __name__ == "__main__":
    typer.run(main)
