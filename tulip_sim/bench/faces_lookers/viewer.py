"""Looks by the bridge as a viewer that shows everything: listens to every topic that it tells of."""

from __future__ import annotations

import json

from tulip_sim.bench.faces_lookers.looker import Tally, look
from tulip_sim.bench.faces_lookers.web_socket import connected


def see(port: int, tally: Tally) -> None:
    """Take all that comes, for ever."""
    with connected(port, "foxglove.sdk.v1") as socket:
        for frame in socket:
            if isinstance(frame, bytes):
                tally.count("bridge: messages [1/s]")
                tally.count("bridge: bytes [1/s]", len(frame))
                continue
            said = json.loads(frame)
            tally.count("bridge: words [1/s]")
            if said["op"] == "advertise":
                wanted = [{"id": each["id"], "channelId": each["id"]} for each in said["channels"]]
                socket.send(json.dumps({"op": "subscribe", "subscriptions": wanted}))


if __name__ == "__main__":
    look(see)
