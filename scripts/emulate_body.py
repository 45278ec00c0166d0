"""Emulate a robot's body behind the wire: its own process, its own clock, bytes over UDP or a serial line."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import sys
from typing import Annotated

import typer

from tulip_driver.wire.links import PORT
from tulip_ros.run import run
from tulip_sim.emulator_node import EmulatorNode
from tulip_sim.scenario import SCENARIOS


def main(
    port: Annotated[int, typer.Option(help="UDP port where the driver is expected.", min=1, max=65535)] = PORT,
    device: Annotated[str, typer.Option(help="Serial line in place of UDP, as in /dev/ttyUSB0.")] = "",
    scenario: Annotated[str, typer.Option(help=", ".join(SCENARIOS))] = "open",
    seed: Annotated[int, typer.Option(help="Of the scenario and of all noise.", min=0)] = 0,
    speed: Annotated[float, typer.Option(help="Of its clock, times real time.")] = 1.0,
    harness: Annotated[bool, typer.Option("--harness", help="It hangs from its trunk, feet off the ground.")] = False,
) -> None:
    """Emulate a body until Ctrl-C.

    Meanwhile `launch.py --driver wire` plays with it, and `driver_check.py --driver wire` checks its driver. Camera and
    referee are on topics, as those of any robot.
    """
    values = {"port": port, "device": f"'{device}'", "scenario": scenario, "seed": seed, "speed": float(speed)}
    values["harness"] = str(harness).lower()
    settings = [word for name, value in values.items() for word in ("-p", f"{name}:={value}")]
    print(f"a body listens at {device or f'UDP port {port}'} until Ctrl-C", file=sys.stderr)
    run(EmulatorNode, EmulatorNode.advance, [sys.argv[0], "--ros-args", *settings])


if __name__ == "__main__":
    typer.run(main)
