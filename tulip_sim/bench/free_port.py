"""Ports and a domain for graphs that a bench plays beside whatever else runs on this machine."""

from __future__ import annotations

import os
import socket


def free_port(kind: socket.SocketKind = socket.SOCK_DGRAM) -> int:
    """Return a port of the loopback interface that nobody uses now: of UDP, or SOCK_STREAM for one of TCP."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def own_domain() -> None:
    """Keep other graphs of this machine out of those that this process starts, unless ROS_DOMAIN_ID is set."""
    os.environ.setdefault("ROS_DOMAIN_ID", str(60 + os.getpid() % 40))
