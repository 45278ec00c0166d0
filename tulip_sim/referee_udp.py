"""Sends the referee's packets over real UDP and collects the robots' replies."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from ipaddress import ip_address

from tulip_strategy.game_controller import REFEREE_PORT, Rejected, Reply, decode_reply

MOST_REPLIES = 100  # at a time: a flood must not stop the simulation
REPLY_SIZE = 512  # [B] more than any reply has


class RefereeSocket:
    """A UDP socket that speaks as the referee program does."""

    def __init__(
        self,
        address: str = "127.0.0.1",
        port: int = REFEREE_PORT,
        reply_port: int = 0,
        further_ports: Sequence[int] = (),
    ) -> None:
        """Open the socket.

        Args:
            address: Where robots listen; a broadcast address reaches all robots of a network.
            port: Their port.
            reply_port: Where they send their replies: 3939 from version 12 on. 0 for those of versions 7 and 8, which
                robots on this machine send to where the packets come from.

            further_ports: Of further robots on one machine, where a port can have one listener only.

        Raises:
            OSError: if the reply port is in use.
        """
        self._targets = [(address, each) for each in (port, *further_ports)]
        self._listening = _listen(address, reply_port) if reply_port else None
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
        self._socket.setblocking(False)
        self.lost = 0
        """Packets that the system did not take."""

    def send(self, packet: bytes) -> None:
        """Send a packet; a network that does not take it is counted, since the next one follows soon."""
        for target in self._targets:
            try:
                self._socket.sendto(packet, target)
            except OSError:
                self.lost += 1

    def replies(self) -> list[Reply | Rejected]:
        """Return what robots have sent since the last time."""
        received = _received(self._socket)
        return received if self._listening is None else received + _received(self._listening)

    def close(self) -> None:
        """Close the socket."""
        self._socket.close()
        if self._listening is not None:
            self._listening.close()

    def __enter__(self) -> RefereeSocket:
        """Return the socket itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close the socket."""
        self.close()


def _received(source: socket.socket) -> list[Reply | Rejected]:
    received: list[Reply | Rejected] = []
    while len(received) < MOST_REPLIES:
        try:
            received.append(decode_reply(source.recv(REPLY_SIZE)))
        except BlockingIOError:
            break
        except ConnectionRefusedError:
            continue  # the system's notice that nobody listened to a packet sent before
    return received


def _listen(address: str, port: int) -> socket.socket:
    """Open a socket for replies: of this machine alone when the robots are on it, else of all networks."""
    opened = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        opened.bind((address if ip_address(socket.gethostbyname(address)).is_loopback else "", port))
    except OSError:
        opened.close()
        raise
    opened.setblocking(False)
    return opened
