"""A WebSocket to a face, for the programs that look without a browser."""

from __future__ import annotations

from websockets.sync.client import ClientConnection, connect
from websockets.typing import Subprotocol

from tulip_sim.bench.faces_lookers.looker import wait_for


def connected(port: int, protocol: str) -> ClientConnection:
    """Return a WebSocket to a port of this machine, once somebody listens there."""
    wait_for(port)
    return connect(f"ws://127.0.0.1:{port}", subprotocols=[Subprotocol(protocol)], max_size=None, compression=None)
