"""Who may connect to the bridge, and what a viewer may call and publish, without a graph."""

from __future__ import annotations

import pytest

from tulip_ros import topics
from tulip_view.bridge.handshake import RefusedError, admit, answered
from tulip_view.bridge.rules import known_service, why_not_publish
from tulip_view.bridge.settings import BridgeParameters


def request(origin: str | None, protocols: str = "foxglove.websocket.v1, foxglove.sdk.v1") -> bytes:
    lines = [
        "GET / HTTP/1.1",
        "Host: robot:8765",
        "Upgrade: WebSocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Key: AAAA",
        f"Sec-WebSocket-Protocol: {protocols}",
        *([] if origin is None else [f"Origin: {origin}"]),
    ]
    return "\r\n".join(lines).encode() + b"\r\n\r\n"


@pytest.mark.parametrize(
    "origin",
    [
        None,
        "http://localhost",
        "http://localhost:8080",
        "https://127.0.0.1:3000",
        "http://127.8.9.1",
        "http://[::1]:3000",
        "https://app.foxglove.dev",
        "file://",
    ],
)
def test_this_machines_pages_and_foxglove_come_in(origin: str | None):
    assert admit(request(origin)).name == "foxglove.sdk.v1"


@pytest.mark.parametrize(
    "origin",
    [
        "null",
        "",
        "http://evil.example",
        "http://localhost.evil.example",
        "http://127.0.0.1.evil.example",
        "http://192.168.0.7:8080",
        "https://app.foxglove.dev.evil.example",
        "http://app.foxglove.dev",
        "http://[evil",
    ],
)
def test_foreign_pages_stay_outside_unless_they_are_named(origin: str):
    with pytest.raises(RefusedError, match="start the bridge with --origin") as refused:
        admit(request(origin))
    assert refused.value.answer().startswith(b"HTTP/1.1 403 Forbidden\r\n")
    assert admit(request(origin), [origin]).name == "foxglove.sdk.v1"


def test_request_passed_on_differs_in_the_protocols_name_alone():
    before = request("http://localhost", "foxglove.websocket.v1")
    admission = admit(before)
    assert admission.name == "foxglove.websocket.v1"
    lines, passed_on = (set(head.decode().split("\r\n")) for head in (before, admission.request))
    assert lines - passed_on == {"Sec-WebSocket-Protocol: foxglove.websocket.v1"}
    assert passed_on - lines == {"Sec-WebSocket-Protocol: foxglove.sdk.v1"}
    assert admission.request.endswith(b"\r\n\r\n")


def test_answer_bears_the_name_that_the_viewer_knows():
    head = b"HTTP/1.1 101 Switching Protocols\r\nupgrade: websocket\r\nsec-websocket-protocol: foxglove.sdk.v1\r\n\r\n"
    told = answered(head, "foxglove.websocket.v1")
    assert told.startswith(b"HTTP/1.1 101 Switching Protocols\r\n") and told.count(b"foxglove") == 1
    assert b"Sec-WebSocket-Protocol: foxglove.websocket.v1\r\n" in told
    refusal = b"HTTP/1.1 400 Bad Request\r\n\r\n"
    assert answered(refusal, "foxglove.websocket.v1") == refusal


@pytest.mark.parametrize(
    "head", [b"GET / HTTP/1.1\r\n\r\n", b"POST / HTTP/1.1\r\nUpgrade: websocket\r\n\r\n", b"\r\n\r\n"]
)
def test_what_is_no_websocket_is_told_what_to_do(head: bytes):
    with pytest.raises(RefusedError, match="Open connection"):
        admit(head)


def test_head_of_too_many_lines_is_refused():
    with pytest.raises(RefusedError, match="no HTTP request"):
        admit(b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 500 + b"\r\n")


def test_services_are_known_in_any_namespace_by_name_and_type():
    assert known_service("/start", "std_srvs/srv/Trigger") is topics.START
    assert known_service("/striker/simulation/push", "tulip_msgs/srv/Push") is topics.PUSH
    assert known_service("/restart", "std_srvs/srv/Trigger") is None
    assert known_service("/start", "std_srvs/srv/Empty") is None
    assert known_service("/motion/set_parameters", "rcl_interfaces/srv/SetParameters") is None


def test_only_what_people_say_may_be_published():
    assert why_not_publish("/keeper/user_wish", "tulip_msgs/msg/UserCommand", "cdr") == ""
    assert why_not_publish("/initialpose", "geometry_msgs/PoseWithCovarianceStamped", "cdr") == ""
    for topic in set(topics.TOPICS) - set(topics.FROM_PEOPLE):
        assert "is not for viewers to publish" in why_not_publish(f"/{topic.name}", topic.type_name, "cdr")


def test_port_is_checked():
    with pytest.raises(ValueError, match="port is -1; expected 0 to 65535"):
        BridgeParameters(port=-1)


@pytest.mark.parametrize("namespace", ["/a b", "/", "/3x", "/{x}", "/motion\0", "/\ud800", "/a\n", "/" + "a" * 300])
def test_a_name_that_ros_would_not_take_is_refused_in_words(namespace: str):
    refusal = why_not_publish(f"{namespace}/user_wish", "tulip_msgs/msg/UserCommand", "cdr")
    assert "is no name of a topic" in refusal


def test_what_a_stranger_says_does_not_steer_the_terminal_that_shows_it():
    with pytest.raises(RefusedError) as refused:
        admit(request("http://\x1b[2Jevil.example"))
    assert str(refused.value).isprintable() and "evil.example" in str(refused.value)
