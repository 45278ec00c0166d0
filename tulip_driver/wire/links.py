"""Ways for packets to go: UDP, and a serial line. Each sends bytes and gives those that came."""

from __future__ import annotations

import os
import select
import socket
import termios
import time
from collections import deque
from typing import Protocol

from tulip_driver.contract import BodyError
from tulip_driver.wire.packet import LONGEST, Stream

PORT = 4747
"""UDP port of a body."""


class Link(Protocol):
    """Connects two ends."""

    def send(self, data: bytes) -> None:
        """Send a packet; one that is lost is followed by the next soon."""

    def receive(self, timeout: float) -> bytes | None:
        """Return the next packet's bytes; None if none comes within so many seconds [s]."""

    def close(self) -> None:
        """End."""


class UdpClient:
    """The driver's end.

    Args:
        address: Of the body.
        port: Of the body.

    Raises:
        BodyError: if there is no such address.
    """

    def __init__(self, address: str, port: int) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.connect((address, port))  # hears nobody else then
        except (OSError, OverflowError) as error:
            self._socket.close()
            raise BodyError(f"The body cannot be at {address}, port {port}: {error}.") from error

    def send(self, data: bytes) -> None:
        """Send a packet."""
        try:
            self._socket.send(data)
        except OSError:
            pass  # nobody listens yet, or the network is down: silence will tell

    def receive(self, timeout: float) -> bytes | None:
        """Return the next packet's bytes, or None."""
        return _received(self._socket, timeout)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class UdpServer:
    """The body's end: answers whoever sent the newest packet that was taken, see `keep`.

    Args:
        address: Where to listen; 127.0.0.1 for this machine alone.
        port: Where to listen; 0 for any that is free.

    Raises:
        BodyError: if the port is taken.
    """

    def __init__(self, address: str = "127.0.0.1", port: int = PORT) -> None:
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.bind((address, port))
        except (OSError, OverflowError) as error:
            self._socket.close()
            raise BodyError(
                f"A body cannot listen on UDP {address}:{port}: {error}. End the program that uses the port "
                "(`ss -ulpn` lists them), or choose another one."
            ) from error
        self._last: tuple[str, int] | None = None  # sender of the packet received last
        self._peer: tuple[str, int] | None = None

    @property
    def port(self) -> int:
        """Where it listens."""
        return int(self._socket.getsockname()[1])

    def send(self, data: bytes) -> None:
        """Send a packet to the driver, if there is one."""
        self._send(data, self._peer)

    def reply(self, data: bytes) -> None:
        """Send a packet to the sender of the one received last."""
        self._send(data, self._last)

    def _send(self, data: bytes, target: tuple[str, int] | None) -> None:
        try:
            if target is not None:
                self._socket.sendto(data, target)
        except OSError:
            pass  # the network does not take it: the next one follows soon

    def receive(self, timeout: float) -> bytes | None:
        """Return the next packet's bytes, or None."""
        if not _readable(self._socket, timeout):
            return None
        try:
            data, self._last = self._socket.recvfrom(LONGEST)
        except OSError:
            return None  # the system's notice that nobody listened to a packet sent before
        return data

    def keep(self) -> None:
        """From now on talk to the sender of the packet received last."""
        self._peer = self._last

    @property
    def from_peer(self) -> bool:
        """Whether the packet received last came from whom it talks to."""
        return self._peer is not None and self._last == self._peer

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()


class SerialLine:
    """A serial line, or anything else that is a terminal: both ends are alike.

    Args:
        device: As in /dev/ttyUSB0.
        baud: Bits a second; 14 joints at 250 Hz need 560 000 each way.

    Raises:
        BodyError: if it cannot be opened.
    """

    def __init__(self, device: str, baud: int = 2_000_000) -> None:
        speed = getattr(termios, f"B{baud}", None)
        if speed is None:
            raise BodyError(f"Serial line {device} cannot run at {baud} bits a second; expected as in 2000000.")
        try:
            self._file = os.open(device, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise BodyError(f"Serial line {device} cannot be opened: {error.strerror}.") from error
        try:
            settings = termios.tcgetattr(self._file)
            settings[0] = settings[1] = settings[3] = 0  # bytes as they are: no translation, no echo, no lines
            settings[2] = termios.CS8 | termios.CREAD | termios.CLOCAL
            settings[4] = settings[5] = speed
            termios.tcsetattr(self._file, termios.TCSANOW, settings)
        except termios.error as error:
            os.close(self._file)
            raise BodyError(f"{device} is no serial line: {error.args[-1]}.") from error
        self._stream = Stream()
        self._packets: deque[bytes] = deque()

    def send(self, data: bytes) -> None:
        """Send a packet."""
        try:
            os.write(self._file, data)
        except OSError:
            pass  # the line is full or gone: silence will tell

    def receive(self, timeout: float) -> bytes | None:
        """Return the next packet's bytes, or None."""
        end = time.monotonic() + timeout
        while not self._packets:
            if not select.select([self._file], [], [], max(end - time.monotonic(), 0.0))[0]:
                return None
            try:
                self._packets.extend(self._stream.feed(os.read(self._file, 4096)))
            except OSError:
                return None
        return self._packets.popleft()

    def reply(self, data: bytes) -> None:
        """Send a packet to the only one there is."""
        self.send(data)

    def keep(self) -> None:
        """There is one at the other end."""

    @property
    def from_peer(self) -> bool:
        """There is nobody else."""
        return True

    def close(self) -> None:
        """Close the device."""
        os.close(self._file)


def _readable(source: socket.socket, timeout: float) -> bool:
    return bool(select.select([source], [], [], max(timeout, 0.0))[0])


def _received(source: socket.socket, timeout: float) -> bytes | None:
    if not _readable(source, timeout):
        return None
    try:
        return source.recv(LONGEST)
    except OSError:
        return None
