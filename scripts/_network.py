"""The option --network of all commands that join a graph."""

from __future__ import annotations

from typing import Annotated

import typer

from tulip_ros import network

Network = Annotated[str, typer.Option(network.OPTION, metavar="PEER[,PEER]", help=network.HELP)]
"""What `tulip_ros.network.join` is given."""
