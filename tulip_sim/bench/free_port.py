"""Ports for matches that a bench plays beside whatever else runs on this machine."""

from __future__ import annotations

import socket


def free_port() -> int:
    """Return a UDP port of the loopback interface that nobody uses now."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
