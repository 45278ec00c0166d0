"""Bodies that tell the bench `drivers` when they are told to have no stiffness."""

from __future__ import annotations

import socket
import struct
import time
from collections.abc import Callable
from typing import Any, ClassVar

from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.contract import Body
from tulip_driver.echo import EchoBody
from tulip_driver.wire.body import WireBody

MOMENT = struct.Struct("<d")
"""Of the machine's monotonic clock [s], in a UDP packet on loopback."""


class ToldEcho(Body):
    """Driver `echo`.

    Args:
        robot: What it is like.
        report: UDP port of the bench.
        options: Of the body behind it.
    """

    hardware = False
    make: ClassVar[Callable[..., Body]] = EchoBody

    def __init__(self, robot: Robot, report: int, **options: Any) -> None:
        self._body = type(self).make(robot, **options)
        self._bench = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._bench.connect(("127.0.0.1", report))
        self._stiff = False

    def start(self) -> None:
        """Start the body."""
        self._body.start()

    def exchange(self, command: JointCommand | None) -> Sensors:
        """Tell when stiffness ends, and hand the command on."""
        if command is not None:
            before, self._stiff = self._stiff, bool(command.stiffness.any())
            if before and not self._stiff:
                self._bench.send(MOMENT.pack(time.monotonic()))
        return self._body.exchange(command)

    def stop(self) -> None:
        """Stop the body."""
        self._body.stop()


class ToldWire(ToldEcho):
    """Driver `wire`."""

    own_clock = True
    make = WireBody
