"""Start the robot's nodes, each a process, and show how they are until Ctrl-C."""

from __future__ import annotations

import sys

import _environment

if __name__ == "__main__":
    _environment.prepare([name for name in ("view", "bridge", "mujoco") if {name, f"--{name}"} & set(sys.argv)])

import signal
from pathlib import Path
from typing import Annotated

import typer
from _network import Network
from rich.console import Console
from rich.live import Live

from tulip_ros import network, plan
from tulip_ros.emergency_stop import StopLink
from tulip_ros.errors import EXIT_BAD_INPUT, EXIT_GIVEN_UP, BadInputError, require, unknown
from tulip_ros.launch import Launcher
from tulip_ros.log_file import Log
from tulip_ros.monitor import Monitor
from tulip_ros.nodes import AGGREGATOR, DRIVER, LOOKERS, ROBOT
from tulip_ros.run import ComponentNode, session
from tulip_ros.transport import NAMES as TRANSPORTS
from tulip_view.live.beside import PORT, address, page_beside

LOOK = 0.2  # [s] between two looks at the processes
HEED = 0.05  # [s] in which Ctrl-C is noticed; 0.02 would cost 0.5 % of a core more
TOLD = 0.2  # [s] at most until everybody knows of an emergency stop
MOVING = frozenset({DRIVER, "motion", "identify"})
"""Nodes without which the joints are not commanded any more: before they are ended, the robot goes limp."""


def main(
    nodes: Annotated[
        list[str] | None, typer.Argument(help=f"Nodes to start; none: the robot. {plan.known_names()}")
    ] = None,
    driver: Annotated[
        str | None,
        typer.Option(
            help="What stands for the body: a name, package.module:Class, or none. By default sim; none where all nodes"
            f" only look ({', '.join(sorted(LOOKERS))})."
        ),
    ] = None,
    namespace: Annotated[str, typer.Option(help="Namespace of the robot, as in 'striker'.")] = "",
    parameters: Annotated[list[Path] | None, typer.Option(help="YAML file `node: {name: value}`; repeatable.")] = None,
    log: Annotated[Path | None, typer.Option(help="Recording that driver 'log' plays back.")] = None,
    record: Annotated[Path | None, typer.Option(help="Record all topics into this new folder.")] = None,
    bridge: Annotated[bool, typer.Option("--bridge", help="Also the bridge to Foxglove, for this machine.")] = False,
    transport: Annotated[str, typer.Option(help="auto, shared_memory or udp")] = "auto",
    logs: Annotated[Path | None, typer.Option(help="Folder for one log file a node.")] = None,
    view: Annotated[bool, typer.Option("--view", help="Open a page to watch and steer in a browser.")] = False,
    view_port: Annotated[int, typer.Option(help="TCP port of that page.", min=1, max=65535)] = PORT,
    rehearse: Annotated[
        bool, typer.Option("--rehearse", help="First play the walk in the simulator; start nothing if it fails.")
    ] = False,
    anyway: Annotated[bool, typer.Option("--anyway", help="Start all the same if it fails.")] = False,
    peers: Network = "",
) -> None:
    """Start nodes and keep them running."""
    try:
        if transport not in TRANSPORTS:
            raise unknown("transport", transport, TRANSPORTS)
        if driver is None:
            driver = "none" if nodes and set(nodes) <= LOOKERS else "sim"
        names = list(nodes or ROBOT) + (["recorder"] if record else []) + (["bridge"] if bridge else [])
        if "bridge" in names:
            require("foxglove", "bridge")
        if driver == "mujoco":
            require("mujoco", "mujoco")
        values = {"recorder": {"path": str(record.absolute())}} if record else {}
        if log is not None:
            if driver != "log":
                raise BadInputError(f"--log is for --driver log; the driver is {driver!r}.")
            with Log(log):  # says what is wrong with it before anything starts
                values["driver"] = {"file": str(log.absolute())}
        starts = plan.make_plan(names, None if driver == "none" else driver, namespace, parameters or (), values)
        if anyway and not rehearse:
            raise BadInputError("--anyway is for a rehearsal; give --rehearse with it.")
        if rehearse:
            from _rehearsal import REFUSED, may_launch  # brings the simulator, which others need not wait for

            if not may_launch(starts, anyway):
                raise typer.Exit(REFUSED)
        network.join(peers, transport)
        if view:
            starts += page_beside(view_port, plan.check_namespace(namespace))
            print(f"watch it at {address(view_port)}", file=sys.stderr)
        keep_running(Launcher(starts, logs, transport), namespace)
    except BadInputError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None


def keep_running(launcher: Launcher, namespace: str) -> None:
    """Run the nodes until Ctrl-C or SIGTERM; on a terminal with a table, else with a line for each event.

    Where they move the robot, the end of them is an emergency stop; and whatever happens, the driver ends first.
    """
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    console = Console(stderr=True)
    console.print(f"logs: {launcher.log_folder}", highlight=False, soft_wrap=True)
    try:
        with (
            launcher,
            session(lambda: ComponentNode("launcher", namespace=namespace), arguments=[], handle_signals=False) as (
                node,
                spin,
            ),
            Live(console=console, auto_refresh=False, transient=False) as live,
        ):
            names = [state.name for state in launcher.states()]
            # Who starts tools beside a running robot leaves the sum to the one who started the robot.
            monitor = Monitor(node, names, publishes=bool({DRIVER, *ROBOT} & set(names)) and AGGREGATOR not in names)
            stop = StopLink(node, "launcher") if MOVING & set(names) else None
            try:
                while True:
                    for _ in range(round(LOOK / HEED)):
                        spin(HEED)
                        for line in launcher.poll():
                            console.print(line, highlight=False, markup=False, soft_wrap=True)
                    if console.is_terminal:
                        live.update(monitor.table(launcher.states()), refresh=True)
            except KeyboardInterrupt:
                if stop is not None:
                    stop.engage("its nodes are ended")
                    stop.wait_until_told(TOLD)
                raise
    except KeyboardInterrupt:
        console.print("all nodes ended", highlight=False)
    if launcher.given_up:
        given_up = ", ".join(launcher.given_up)
        console.print(f"error: given up, since it died again and again: {given_up}", style="bold red", highlight=False)
        raise typer.Exit(EXIT_GIVEN_UP)


if __name__ == "__main__":
    typer.run(main)
