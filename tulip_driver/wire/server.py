"""The body's end of the wire, as the firmware of a robot would be; here for emulated ones."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import Protocol

from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.parts import limp_command
from tulip_driver.wire.frames import command_of, identity_frames, reading_frames
from tulip_driver.wire.links import Link
from tulip_driver.wire.packet import Kind, Packet, VersionError, WireError, decode, encode


class BodyLink(Link, Protocol):
    """A link that chooses whom it talks to."""

    def keep(self) -> None:
        """From now on talk to the sender of the packet received last."""

    def reply(self, data: bytes) -> None:
        """Send a packet to the sender of the one received last."""

    @property
    def from_peer(self) -> bool:
        """Whether the packet received last came from whom it talks to."""


class WireServer:
    """Answers hellos, takes commands, sends readings.

    It obeys the driver that greeted it last. Packets that are not understood, of a stranger, or older than one that
    was taken change nothing.

    Args:
        link: To the driver.
        names: Of the body's joints.

    Attributes:
        refused: Packets that changed nothing, by reason in a few words.
    """

    def __init__(self, link: BodyLink, names: Sequence[str]) -> None:
        self._link, self._names = link, tuple(names)
        self._heard = 0  # sequence of the driver's newest packet
        self._sequence, self._taken = 0, 0
        self._newest: Sensors | None = None
        self.refused: dict[str, int] = {}

    def receive(self, timeout: float) -> JointCommand | None:
        """Return the next command, if one comes within so many seconds [s]; a stop is one without torque.

        Its sequence grows with each, whichever driver it comes from.
        """
        end = time.monotonic() + timeout
        while True:
            data = self._link.receive(max(end - time.monotonic(), 0.0))
            if data is None:
                return None
            command = self._take(data)
            if command is not None:
                self._taken += 1
                return replace(command, sequence=self._taken)

    def begin_anew(self) -> None:
        """The body's time begins anew: until the next reading was sent, no command can be an answer."""
        self._newest = None

    def send(self, sensors: Sensors) -> None:
        """Send a reading."""
        self._newest = sensors
        self._sequence += 1
        self._link.send(encode(Packet(Kind.READING, self._sequence, sensors.stamp, reading_frames(sensors))))

    def close(self) -> None:
        """End the link."""
        self._link.close()

    def _take(self, data: bytes) -> JointCommand | None:
        try:
            packet = decode(data)
            if packet.kind is Kind.HELLO:
                self._welcome(packet)
            elif not self._link.from_peer:
                self._refuse("packets of a stranger")
            elif packet.sequence <= self._heard:
                self._refuse("stale packets")
            elif packet.kind is Kind.COMMAND and (self._newest is None or packet.stamp > self._newest.stamp):
                self._refuse("answers to readings of another time")  # this body's time began anew
            elif packet.kind is Kind.COMMAND:
                command = command_of(packet, self._names)
                self._heard = packet.sequence
                return command
            elif packet.kind is Kind.STOP:
                self._heard = packet.sequence
                return limp_command(self._names, packet.sequence, packet.stamp)
        except VersionError:
            self._refuse("packets of another version")
            self._link.reply(self._identity())  # from which it learns that versions differ
        except WireError:
            self._refuse("packets that are not understood")
        return None

    def _welcome(self, packet: Packet) -> None:
        self._link.keep()
        self._heard = packet.sequence
        self._link.send(self._identity())
        if self._newest is not None:
            self.send(self._newest)

    def _identity(self) -> bytes:
        self._sequence += 1
        return encode(Packet(Kind.IDENTITY, self._sequence, 0, identity_frames(self._names)))

    def _refuse(self, reason: str) -> None:
        self.refused[reason] = self.refused.get(reason, 0) + 1
