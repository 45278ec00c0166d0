"""Where the bridge listens, and to whom."""

from __future__ import annotations

from dataclasses import dataclass

LOOPBACK, LAN = "127.0.0.1", "0.0.0.0"
"""Addresses to listen on: for this machine alone, and for all networks."""
PORT = 8765
"""The port that Foxglove proposes."""
LAN_MEANS = (
    "every machine in your networks that reaches the port sees everything, commands the robot and sets its parameters; "
    "there is no password, and nothing is encrypted. Only where you trust everyone."
)


@dataclass(frozen=True)
class BridgeParameters:
    """Where the bridge listens, and to whom.

    Attributes:
        host: Address to listen on; this machine alone by default, `LAN` for all networks.
        port: Port to listen on; 0 for any that is free.
        origins: Pages that may connect besides those of this machine and Foxglove's, as in "http://192.168.0.7:8080".
    """

    host: str = LOOPBACK
    port: int = PORT
    origins: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not 0 <= self.port < 65536:
            raise ValueError(f"port is {self.port}; expected 0 to 65535")
