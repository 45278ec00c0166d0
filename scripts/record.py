"""Record the topics of a running graph into MCAP until Ctrl-C."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import sys
from pathlib import Path
from typing import Annotated

import typer
from _network import Network

from tulip_ros import network
from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError
from tulip_ros.mcap_file import COMPRESSIONS
from tulip_ros.picture_rate import PICTURE_RATE
from tulip_ros.plan import check_namespace
from tulip_ros.recorder_node import PICTURES, RecorderNode, RecorderParameters
from tulip_ros.run import run


def main(
    path: Annotated[
        Path | None,
        typer.Argument(help="New folder for the recording, or with --wait for several; none: recordings/DATE."),
    ] = None,
    include: Annotated[
        list[str] | None, typer.Option(help="Regular expression of whole topic names; repeatable.")
    ] = None,
    exclude: Annotated[
        list[str] | None, typer.Option(help="Regular expression of whole topic names; repeatable.")
    ] = None,
    pictures: Annotated[
        str, typer.Option(help=f"The cameras' pictures: {', '.join(PICTURES)}. Raw ones take 14 MB a second each.")
    ] = "compressed",
    picture_rate: Annotated[
        float, typer.Option(help="Pictures of each camera in a second of the recording; 0 for all.")
    ] = PICTURE_RATE,
    compression: Annotated[
        str, typer.Option(help=f"{' or '.join(COMPRESSIONS)}; none is faster, for raw pictures of many cameras.")
    ] = "zstd",
    sync: Annotated[
        bool, typer.Option(help="Have the disk keep what is written, so that a loss of power costs a second.")
    ] = True,
    split_size: Annotated[float, typer.Option(help="MB after which the next file is begun; 0 for one file.")] = 0.0,
    split_time: Annotated[float, typer.Option(help="Seconds after which the next file is begun; 0: never.")] = 0.0,
    wait: Annotated[
        bool, typer.Option("--wait", help="Begin when the menu, or the service start_recording, says so.")
    ] = False,
    namespace: Annotated[str, typer.Option(help="Namespace of the robot, as in 'striker'.")] = "",
    peers: Network = "",
) -> None:
    """Record all topics, or those that match."""
    try:
        namespace = check_namespace(namespace)
        settings = RecorderParameters(
            folder=str(path) if path and wait else RecorderParameters.folder,
            path=str(path) if path and not wait else "",
            start=not wait,
            include=tuple(include or ()),
            exclude=tuple(exclude or ()),
            pictures=pictures,
            picture_rate=picture_rate,
            compression=compression,
            sync=sync,
            split_size=split_size,
            split_time=split_time,
        )
        network.join(peers)
    except (BadInputError, ValueError) as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    run(lambda: RecorderNode(settings, namespace), arguments=[])


if __name__ == "__main__":
    typer.run(main)
