"""The option --network of commands that start nodes or look at them."""

from __future__ import annotations

from typing import Annotated

import typer

from tulip_ros import network

Network = Annotated[str, typer.Option(network.OPTION, metavar=network.METAVAR, help=network.HELP)]
"""What `tulip_ros.network.join` is given."""
