"""The referee's socket as the simulator's nodes use it: errors for people, replies counted in diagnostics."""

from __future__ import annotations

from collections.abc import Sequence

from tulip_ros.errors import BadInputError
from tulip_ros.health import Health
from tulip_sim.referee_udp import RefereeSocket
from tulip_strategy.game_controller import REFEREE_PORT, Rejected
from tulip_strategy.game_controller.replies import ANSWERS


def open_referee(
    address: str, port: int, version: int, reply_port: int = 0, further_ports: Sequence[int] = ()
) -> RefereeSocket:
    """Open the socket of a referee who speaks a version.

    Args:
        address: Where robots listen.
        port: Their port.
        version: Of the packets.
        reply_port: Where replies come in; 0 for the port that the version has.
        further_ports: Of further robots on the same machine.

    Raises:
        BadInputError: if the reply port cannot be opened.
    """
    reply_port = reply_port or ANSWERS[version][1]
    try:
        # Robots on this machine hold their own port themselves: they answer where the packets come from.
        return RefereeSocket(address, port, 0 if reply_port == REFEREE_PORT else reply_port, further_ports)
    except OSError as error:
        raise BadInputError(
            f"The referee cannot hear robots on UDP port {reply_port}: {error.strerror or error}. End the program that "
            "uses it (`ss -ulpn` lists them), or set the parameter reply_port of nodes driver and game_input."
        ) from error


def hear_replies(referee: RefereeSocket, health: Health) -> None:
    """Take what robots have sent, so that it does not fill the system's buffer, and count it."""
    for reply in referee.replies():
        if isinstance(reply, Rejected):
            health.count("rejected replies", f"a robot's reply is not understood: {reply.reason}")
        else:
            health.count("replies of robots")
