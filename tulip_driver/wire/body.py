"""The driver's end of the wire: a body somewhere else, with its own computer and its own clock."""

from __future__ import annotations

import time

from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.contract import LONGEST_WAIT, Body, BodyError
from tulip_driver.wire.frames import check_identity, command_frames, reading_of
from tulip_driver.wire.links import PORT, Link, SerialLine, UdpClient
from tulip_driver.wire.packet import Kind, Packet, VersionError, WireError, decode, encode

KNOCK = 0.1  # [s] of silence after which the body is greeted again: it may have been started anew
MOST_AT_ONCE = 50  # packets that are taken in one exchange: a flood must not hold it up
FAREWELLS = 3  # packets to stop, of which one will arrive


class WireBody(Body):
    """A body that speaks the protocol of docs/wire.md.

    Args:
        robot: What it should be like.
        address: Where the body listens.
        port: Where the body listens.
        device: Serial line in place of UDP, as in /dev/ttyUSB0; "" for UDP.
        baud: Bits a second of that line.
        patience: How long to wait for the body at the start [s].

    Attributes:
        bad: Packets that were not understood since the start, lost on their way for what they tell.
        last_bad: What was wrong with the newest of them, or "".
    """

    own_clock = True

    def __init__(
        self,
        robot: Robot,
        address: str = "127.0.0.1",
        port: int = PORT,
        device: str = "",
        baud: int = 2_000_000,
        patience: float = 2.0,
    ) -> None:
        self._names = robot.joint_names
        self._address, self._port, self._device, self._baud, self._patience = address, port, device, baud, patience
        self._link: Link | None = None
        self._newest: Sensors | None = None
        self._sequence, self._heard = 0, 0  # of our packets, and of the body's
        self._silent_since = 0.0
        self.bad, self.last_bad = 0, ""

    def start(self) -> None:
        """Connect, and wait for the first reading.

        Raises:
            BodyError: if the body does not answer, or is another one.
        """
        self.stop()
        self.bad, self.last_bad = 0, ""
        self._sequence, self._heard = 0, 0
        self._newest = None
        self._link = self.connect()
        end = time.monotonic() + self._patience
        known = False
        while not (known and self._newest is not None):
            if time.monotonic() > end:
                raise BodyError(self._why_silent(known))
            self._send(Kind.HELLO)
            again = time.monotonic() + KNOCK
            while (left := again - time.monotonic()) > 0.0 and not (known and self._newest is not None):
                known |= self._receive(left) is Kind.IDENTITY
        self._silent_since = time.monotonic()

    def connect(self) -> Link:
        """Open the way to the body.

        Raises:
            BodyError: if that is not possible.
        """
        return SerialLine(self._device, self._baud) if self._device else UdpClient(self._address, self._port)

    def exchange(self, command: JointCommand | None) -> Sensors:
        """Send the command, and wait for the next reading."""
        if self._link is None or self._newest is None:
            raise BodyError("The body was not started; call start() first.")
        if command is not None:
            self._send(Kind.COMMAND, command)
        before, end = self._newest, time.monotonic() + LONGEST_WAIT * 1e-9
        while self._newest is before and (left := end - time.monotonic()) > 0.0:
            self._receive(left)
        for _ in range(MOST_AT_ONCE):  # of several readings the newest counts
            if self._receive(0.0) is None:
                break
        now = time.monotonic()
        if self._newest is not before:
            self._silent_since = now
        elif now - self._silent_since > KNOCK:
            self._silent_since = now
            self._send(Kind.HELLO)
        return self._newest

    def stop(self) -> None:
        """Tell the body to leave its joints without torque, and disconnect."""
        if self._link is not None:
            for _ in range(FAREWELLS):
                self._send(Kind.STOP)
            self._link.close()
            self._link = None

    def _send(self, kind: Kind, command: JointCommand | None = None) -> None:
        assert self._link is not None
        self._sequence += 1
        if command is None:
            packet = Packet(kind, self._sequence)
        else:
            packet = Packet(kind, self._sequence, command.stamp, command_frames(command, self._names))
        self._link.send(encode(packet))

    def _receive(self, timeout: float) -> Kind | None:
        """Take the next packet and return its kind; None if none came in time, or one that is not understood.

        Raises:
            BodyError: if the body is another one, or speaks another version.
        """
        assert self._link is not None
        data = self._link.receive(timeout)
        if data is None:
            return None
        try:
            packet = decode(data)
            if packet.kind is Kind.READING and packet.sequence > self._heard:
                self._newest, self._heard = reading_of(packet, len(self._names)), packet.sequence
        except VersionError as error:
            raise BodyError(f"The body speaks another version: {error}. Update the older of the two.") from error
        except WireError as error:
            self.bad, self.last_bad = self.bad + 1, str(error)
            return None
        if packet.kind is Kind.IDENTITY:
            self._heard = packet.sequence  # it may have been started anew and count from zero
            try:
                check_identity(packet, self._names)
            except WireError as error:
                raise BodyError(f"It is another robot: {error}.") from error
        return packet.kind

    def _why_silent(self, known: bool) -> str:
        where = self._device or f"{self._address}, UDP port {self._port}"
        if self.bad:
            return (
                f"Of {self.bad} packets from the body at {where} none was understood, the last one because "
                f"{self.last_bad}. Is the line noisy, or its speed wrong?"
            )
        if known:
            return f"The body at {where} answers but sends no readings within {self._patience:g} s."
        return (
            f"The body at {where} does not answer within {self._patience:g} s. Is it switched on and connected? For "
            "the emulated one: python3 scripts/emulate_body.py"
        )
