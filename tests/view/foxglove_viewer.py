"""A viewer of the bridge, from libraries that know nothing of it: websockets, mcap-ros2 and rosbags."""

from __future__ import annotations

import json
import struct
from collections.abc import Callable
from typing import Any

from mcap_ros2._dynamic import generate_dynamic
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.store import Typestore
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

LOOKS = 600  # of 0.05 s, after which something has not come to hold
MESSAGE, TIME, SERVICE_RESPONSE = 1, 2, 3
"""What the server sends, by the first byte."""
PUBLISH, SERVICE_REQUEST = 1, 2
"""What a viewer sends, by the first byte."""


class Viewer:
    """One connection."""

    def __init__(
        self, port: int, spin: Callable[[float], None], name: str = "foxglove.sdk.v1", origin: str | None = None
    ) -> None:
        self._spin = spin
        self.socket = connect(
            f"ws://127.0.0.1:{port}",
            subprotocols=[Subprotocol(name)],
            origin=None if origin is None else Origin(origin),
            max_size=None,
            compression=None,
        )
        self.told: list[dict[str, Any]] = []
        """What the server said as JSON."""
        self.channels: dict[str, dict[str, Any]] = {}
        self.services: dict[str, dict[str, Any]] = {}
        self.messages: dict[str, list[bytes]] = {}
        self.times: list[int] = []
        self._answers: dict[int, bytes | str] = {}
        self._names: dict[int, str] = {}

    def __enter__(self) -> Viewer:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def until(self, holds: Callable[[], Any]) -> Any:
        """Go on until something holds, and return it."""
        for _ in range(LOOKS):
            self._read()
            found = holds()
            if found:
                return found
            self._spin(0.05)
        raise AssertionError(f"it did not come to hold; last told {str(self.told[-1:])[:400]}")

    def _read(self) -> None:
        while True:
            try:
                self._take(self.socket.recv(timeout=0))
            except (TimeoutError, ConnectionClosed):
                return

    def _take(self, frame: str | bytes) -> None:
        if isinstance(frame, str):
            said = json.loads(frame)
            self.told.append(said)
            if said["op"] == "advertise":
                self.channels.update({each["topic"]: each for each in said["channels"]})
            elif said["op"] == "advertiseServices":
                self.services.update({each["name"]: each for each in said["services"]})
            elif said["op"] == "unadvertiseServices":
                self.services = {k: v for k, v in self.services.items() if v["id"] not in said["serviceIds"]}
            elif said["op"] == "serviceCallFailure":
                self._answers[said["callId"]] = said["message"]
        elif frame[0] == MESSAGE:
            number, _ = struct.unpack_from("<IQ", frame, 1)
            self.messages.setdefault(self._names[number], []).append(frame[13:])
        elif frame[0] == TIME:
            self.times.append(struct.unpack_from("<Q", frame, 1)[0])
        elif frame[0] == SERVICE_RESPONSE:
            _, call, length = struct.unpack_from("<III", frame, 1)
            assert frame[13 : 13 + length] == b"cdr"
            self._answers[call] = frame[13 + length :]

    def say(self, op: str, **words: Any) -> None:
        """Send JSON."""
        self.socket.send(json.dumps({"op": op, **words}))

    def said(self, op: str) -> list[dict[str, Any]]:
        """Return what the server said of a kind."""
        return [each for each in self.told if each["op"] == op]

    def subscribe(self, topic: str) -> None:
        """Listen to a topic once it is announced."""
        channel = self.until(lambda: self.channels.get(topic))
        number = len(self._names) + 1
        self._names[number] = topic
        self.say("subscribe", subscriptions=[{"id": number, "channelId": channel["id"]}])

    def decoded(self, topic: str) -> list[Any]:
        """Return what came on a topic, decoded by the definition that the bridge announced."""
        channel = self.channels[topic]
        decode = generate_dynamic(channel["schemaName"], channel["schema"])[channel["schemaName"]]
        return [decode(data) for data in self.messages.get(topic, [])]

    def advertise(self, number: int, topic: str, type_name: str, encoding: str = "cdr") -> None:
        """Ask for publishing on a topic."""
        channel = {"id": number, "topic": topic, "encoding": encoding, "schemaName": type_name}
        self.say("advertise", channels=[channel])

    def publish(self, number: int, data: bytes) -> None:
        """Publish a serialized message."""
        self.socket.send(struct.pack("<BI", PUBLISH, number) + data)

    def send_request(self, name: str, data: bytes, encoding: bytes = b"cdr") -> bytes | str:
        """Call a service; return the serialized answer, or why there is none."""
        service = self.until(lambda: self.services.get(name))
        call = len(self._answers) + 1
        head = struct.pack("<BIII", SERVICE_REQUEST, service["id"], call, len(encoding))
        self.socket.send(head + encoding + data)
        self.until(lambda: call in self._answers)
        return self._answers[call]

    def call(self, name: str, **fields: Any) -> Any:
        """Call a service with a request made from the definition that the bridge announced; return the answer."""
        service = self.until(lambda: self.services.get(name))
        request, response = service["request"], service["response"]
        answer = self.send_request(name, serialized(request["schemaName"], request["schema"], **fields))
        assert isinstance(answer, bytes), answer
        return generate_dynamic(response["schemaName"], response["schema"])[response["schemaName"]](answer)


def serialized(type_name: str, text: str, **fields: Any) -> bytes:
    """Return a message serialized by rosbags from its definition; fields that are messages are given as dicts."""
    store = get_typestore(Stores.EMPTY)
    package, _, name = type_name.split("/")
    as_message = f"{package}/msg/{name}"  # rosbags wants this of a service's request, too
    store.register(get_types_from_msg(text, as_message))
    return bytes(store.serialize_cdr(_made(store, as_message, fields), as_message))


def _made(store: Typestore, type_name: str, fields: dict[str, Any]) -> Any:
    made = {}
    for field, (kind, detail) in store.fielddefs[type_name][1]:
        value = fields.get(field, 0)  # rosbags puts a number into a message without fields
        made[field] = _made(store, detail, value) if kind == Nodetype.NAME else value
    return store.types[type_name](**made)
