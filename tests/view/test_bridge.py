"""The bridge as its viewers see it, through a WebSocket client and decoders that nobody here wrote."""

from __future__ import annotations

import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
from foxglove_viewer import Viewer, serialized
from mcap_ros2._dynamic import generate_dynamic
from ports import free_port
from rclpy.serialization import serialize_message
from rosbags.typesys import get_types_from_msg
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from websockets.exceptions import InvalidStatus

from tulip_msgs.msg import EmergencyStop, UserCommand
from tulip_ros import schemas, topics
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import header, to_message

pytestmark = pytest.mark.ros

SCRIPTS = Path(__file__).parents[2] / "scripts"
URDF = "<robot name='tulip'/>"
SECOND = 1_000_000_000


class Robot(ComponentNode):
    """What a viewer may want to see, and a plain subscriber to compare with."""

    def __init__(self) -> None:
        super().__init__("robot")
        self.joints = self.sender(topics.JOINT_STATES)
        self.description = self.sender(topics.ROBOT_DESCRIPTION)
        self.clock = self.sender(topics.CLOCK)
        self.heard: list[JointState] = []
        self.commands: list[UserCommand] = []
        self.listen(topics.JOINT_STATES, self.heard.append)
        self.listen(topics.USER_COMMAND, self.commands.append)
        self.description.publish(String(data=URDF))


class Graph(NamedTuple):
    port: int
    node: Robot
    spin: Callable[[float], None]

    @contextmanager
    def viewer(self, **options: Any) -> Iterator[Viewer]:
        with Viewer(self.port, self.spin, **options) as viewer:
            yield viewer


@contextmanager
def process(*command: str) -> Iterator[subprocess.Popen[bytes]]:
    started = subprocess.Popen([sys.executable, *command])
    try:
        yield started
        assert started.poll() is None, f"{command} ended by itself"
    finally:
        started.terminate()
        assert started.wait() == 0


@pytest.fixture(scope="module")
def graph(module_ros_domain: int) -> Iterator[Graph]:
    """The bridge and user input, processes of their own, with a node of this process beside them."""
    port = free_port()
    with (
        process("-m", "tulip_view.bridge.bridge_node", "--ros-args", "-p", f"port:={port}"),
        process("-m", "tulip_strategy.user_input_node"),
        session(Robot, ["test"]) as (node, spin),
    ):
        for _ in range(600):
            with socket.socket() as probe:
                if node.commands and probe.connect_ex(("127.0.0.1", port)) == 0:
                    break
            spin(0.05)
        yield Graph(port, node, spin)


def test_channels_are_announced_with_definitions_that_independent_parsers_read(graph: Graph):
    with graph.viewer() as viewer:
        wanted = {"/joint_states", "/robot_description", "/user_command", "/diagnostics", "/clock", "/user_wish"}
        viewer.until(lambda: wanted <= viewer.channels.keys())
        [info] = viewer.said("serverInfo")
    assert {"clientPublish", "parameters", "services", "time"} <= set(info["capabilities"])
    assert info["supportedEncodings"] == ["cdr"]
    assert not [name for name in viewer.channels if name.startswith("/_") or name == "/parameter_events"]
    for channel in viewer.channels.values():
        assert (channel["encoding"], channel["schemaEncoding"]) == ("cdr", "ros2msg")
        assert channel["schemaName"] in generate_dynamic(channel["schemaName"], channel["schema"])
        assert channel["schemaName"] in get_types_from_msg(channel["schema"], channel["schemaName"])
        assert channel["schema"] == schemas.definition(channel["schemaName"])


def test_viewer_gets_what_a_plain_subscriber_gets(graph: Graph):
    graph.node.heard.clear()
    rng = np.random.default_rng(3)
    with graph.viewer() as viewer:
        viewer.subscribe("/joint_states")
        viewer.until(lambda: graph.node.joints.get_subscription_count() == 2)
        for number in range(1, 31):
            position, speed = rng.normal(size=(2, 14)).tolist()
            names = [f"joint_{index}" for index in range(14)]
            graph.node.joints.publish(
                JointState(header=header(number, "base_link"), name=names, position=position, velocity=speed)
            )
            graph.spin(0.01)
        viewer.until(lambda: len(viewer.messages.get("/joint_states", [])) == len(graph.node.heard) == 30)
        seen = viewer.decoded("/joint_states")
    for viewed, heard in zip(seen, graph.node.heard, strict=True):
        assert viewed.header.stamp.nanosec == heard.header.stamp.nanosec
        assert viewed.header.frame_id == heard.header.frame_id == "base_link"
        assert list(viewed.name) == list(heard.name)
        assert list(viewed.position) == list(heard.position) and list(viewed.velocity) == list(heard.velocity)
        assert list(viewed.effort) == list(heard.effort) == []


def test_topic_is_subscribed_only_while_someone_listens_and_who_leaves_disturbs_nobody(graph: Graph):
    count = graph.node.joints.get_subscription_count
    with graph.viewer() as stays:
        stays.until(lambda: count() == 1)  # this process's own
        stays.subscribe("/joint_states")
        with graph.viewer() as leaves:
            leaves.subscribe("/joint_states")
            leaves.until(lambda: count() == 2)
            leaves.socket.socket.shutdown(socket.SHUT_RDWR)  # as when its machine is switched off
        graph.node.joints.publish(JointState(header=header(7)))
        stays.until(lambda: stays.messages.get("/joint_states"))
        stays.say("unsubscribe", subscriptionIds=[1])
        stays.until(lambda: count() == 1)


def test_latched_topic_reaches_each_viewer_however_late(graph: Graph):
    with graph.viewer() as early:
        early.subscribe("/robot_description")
        early.until(lambda: early.messages.get("/robot_description"))
        with graph.viewer() as late:
            late.subscribe("/robot_description")
            late.until(lambda: late.messages.get("/robot_description"))
            assert late.decoded("/robot_description")[0].data == URDF
    assert graph.node.description.get_subscription_count() <= 1


def test_services_of_the_menu_do_what_they_say(graph: Graph):
    with graph.viewer() as viewer:
        answer = viewer.call("/start")
        assert answer.success and answer.message == ""
        viewer.until(lambda: graph.node.commands[-1].request == UserCommand.PLAY)
        wish = {"request": UserCommand.WALK_TEST, "strategy": "", "argument": ""}
        answer = viewer.call("/set_user_command", velocity=np.array([0.1, 0.0, -0.2]), **wish)
        assert answer.success
        viewer.until(lambda: list(graph.node.commands[-1].velocity) == [0.1, 0.0, -0.2])
        answer = viewer.call("/set_user_command", velocity=np.array([9.0, 0.0, 0.0]), **wish)
        assert not answer.success and "expected -0.6 to 0.6" in answer.message
        assert not {name for name in viewer.services if "simulation" in name or "parameters" in name}


def test_request_without_fields_may_come_without_bytes(graph: Graph):
    with graph.viewer() as viewer:
        for data in (b"", b"\0\1\0\0", b"\0\1\0\0\0"):
            assert isinstance(viewer.send_request("/stand", data), bytes)


def test_request_that_is_none_fails_in_words_and_the_next_one_works(graph: Graph):
    with graph.viewer() as viewer:
        assert "are no request of /set_user_command" in str(viewer.send_request("/set_user_command", b"\xff" * 40))
        assert "Unsupported encoding" in str(viewer.send_request("/stop", b"{}", encoding=b"json"))
        assert viewer.call("/stop").success


def wish(request: int) -> bytes:
    """A person's wish, serialized by a library that the bridge does not use."""
    return serialized(
        "tulip_msgs/msg/UserCommand",
        schemas.definition("tulip_msgs/msg/UserCommand"),
        header={"stamp": {"sec": 0, "nanosec": 0}, "frame_id": ""},
        request=request,
        strategy="",
        velocity=np.zeros(3),
        argument="left",
        sequence=0,
    )


def test_published_wish_holds_then(graph: Graph):
    with graph.viewer() as viewer:
        viewer.advertise(1, "/user_wish", "tulip_msgs/msg/UserCommand")
        viewer.until(lambda: graph.node.count_publishers("/user_wish") == 1)
        time.sleep(0.5)  # for user input to find the new publisher
        viewer.publish(1, wish(UserCommand.KICK_TEST))
        viewer.until(lambda: graph.node.commands[-1].request == UserCommand.KICK_TEST)
        assert graph.node.commands[-1].argument == "left"
        viewer.publish(1, b"\xff" * 30)
        viewer.until(
            lambda: [each for each in viewer.said("status") if "are no message of /user_wish" in each["message"]]
        )
        viewer.publish(1, wish(UserCommand.STAND))
        viewer.until(lambda: graph.node.commands[-1].request == UserCommand.STAND)
    with graph.viewer() as viewer:
        viewer.until(lambda: graph.node.count_publishers("/user_wish") == 0)


def test_a_viewer_engages_the_emergency_stop_by_topic_but_releases_it_by_service_alone(graph: Graph):
    def stop(engaged: bool) -> bytes:
        return bytes(serialize_message(EmergencyStop(engaged=engaged, reason="a button")))

    with graph.viewer() as viewer:
        viewer.advertise(1, "/emergency_stop", "tulip_msgs/msg/EmergencyStop")
        viewer.until(lambda: graph.node.count_publishers("/emergency_stop") == 2)  # the other one is user input's
        time.sleep(0.5)  # for user input to find the new publisher
        viewer.publish(1, stop(True))
        viewer.until(lambda: graph.node.commands[-1].request == UserCommand.LIMP)
        viewer.publish(1, stop(False))
        viewer.until(lambda: [each for each in viewer.said("status") if "released by the service" in each["message"]])
        refused = viewer.call("/stand")
        assert not refused.success and refused.message == "emergency stop by viewer (a button); release it first"
        assert viewer.call("/release_emergency_stop").success
        assert viewer.call("/stand").success


@pytest.mark.parametrize(
    ("topic", "type_name", "encoding", "words"),
    [
        ("/legs/joint_command", "tulip_msgs/msg/JointCommand", "cdr", "only user_wish, emergency_stop and initialpose"),
        ("/user_command", "tulip_msgs/msg/UserCommand", "cdr", "is not for viewers to publish"),
        ("/user_wish", "std_msgs/msg/String", "cdr", "expected tulip_msgs/msg/UserCommand"),
        ("/user_wish", "tulip_msgs/msg/UserCommand", "json", "expected cdr"),
    ],
)
def test_publishing_elsewhere_is_refused_in_words(graph: Graph, topic: str, type_name: str, encoding: str, words: str):
    before = graph.node.count_publishers(topic)
    with graph.viewer() as viewer:
        viewer.advertise(5, topic, type_name, encoding)
        viewer.call("/stop")
        assert not viewer.said("status")  # Foxglove announces what its buttons could publish
        viewer.publish(5, wish(UserCommand.PLAY))
        told = viewer.until(lambda: viewer.said("status"))
        assert told[0]["level"] == 2 and words in told[0]["message"]
        assert graph.node.count_publishers(topic) == before


def values(viewer: Viewer, request: str) -> dict[str, Any]:
    [answer] = viewer.until(lambda: [each for each in viewer.said("parameterValues") if each.get("id") == request])
    return {each["name"]: each["value"] for each in answer["parameters"]}


def test_parameters_of_nodes_are_told_and_set_where_the_node_allows(graph: Graph):
    with graph.viewer() as viewer:
        for number in range(100):
            viewer.say("getParameters", parameterNames=[], id=f"all {number}")
            known = values(viewer, f"all {number}")
            if "/user_input.strategy" in known:
                break
            graph.spin(0.1)
        assert known["/user_input.strategy"] == "dribble_and_kick"
        assert known["/user_input.walk_test_limits"] == [0.6, 0.2, 1.0]
        wanted = [
            {"name": "/user_input.strategy", "value": "goalkeeper"},
            {"name": "/robot.use_sim_time", "value": True},
            {"name": "/nobody.gain", "value": 1.0},
        ]
        viewer.say("setParameters", parameters=wanted, id="set")
        now = values(viewer, "set")
        assert now == {"/user_input.strategy": "dribble_and_kick", "/robot.use_sim_time": True}
        assert graph.node.get_parameter("use_sim_time").value is True
        told = viewer.until(lambda: viewer.said("status")[1:] and [each["message"] for each in viewer.said("status")])
        assert "/user_input.strategy stays as it is" in told[0] and "read-only" in told[0]
        assert told[1] == "/nobody.gain stays as it is: there is no such parameter"


@pytest.mark.parametrize(
    "frame",
    [
        "nonsense",
        "{}",
        "[]",
        '{"op":"subscribe","subscriptions":[{"id":1,"channelId":99999}]}',
        '{"op":"subscribe","subscriptions":7}',
        '{"op":"advertise","channels":[{"id":-1}]}',
        '{"op":"setParameters","parameters":[{"name":null}]}',
        '{"op":"unsubscribe","subscriptionIds":[4]}',
        '{"op":"destroy"}',
        "{" * 2000,
        b"",
        b"\x01",
        b"\x01\xff\xff\xff\xffdata",
        b"\x02\xff\xff\xff\xff\0\0\0\0\xff\xff\xff\xff",
        b"\xff" * 100,
    ],
)
def test_malformed_message_does_no_harm(graph: Graph, frame: str | bytes):
    with graph.viewer() as viewer:
        viewer.socket.send(frame)
        assert viewer.call("/stop").success
    with graph.viewer() as viewer:
        assert viewer.call("/stop").success


def test_clock_is_told_and_its_jump_back_begins_a_new_session(graph: Graph):
    with graph.viewer() as viewer:
        for stamp in (5 * SECOND, 6 * SECOND, 1 * SECOND):
            graph.node.clock.publish(Clock(clock=to_message(stamp)))
            viewer.until(lambda stamp=stamp: viewer.times and viewer.times[-1] == stamp)
        first, second = viewer.until(lambda: viewer.said("serverInfo")[1:] and viewer.said("serverInfo"))
        assert first["sessionId"] != second["sessionId"]


@pytest.mark.parametrize("name", ["foxglove.sdk.v1", "foxglove.websocket.v1"])
def test_both_names_of_the_protocol_are_spoken(graph: Graph, name: str):
    with graph.viewer(name=name) as viewer:
        assert viewer.socket.subprotocol == name
        assert viewer.call("/stop").success


@pytest.mark.parametrize("origin", [None, "http://localhost:8080", "https://app.foxglove.dev"])
def test_own_pages_and_foxglove_may_connect(graph: Graph, origin: str | None):
    with graph.viewer(origin=origin) as viewer:
        assert viewer.call("/stop").success


@pytest.mark.parametrize("options", [{"origin": "http://evil.example"}, {"origin": "null"}, {"name": "chat"}])
def test_foreign_page_or_protocol_is_refused_in_words(graph: Graph, options: dict[str, str]):
    with pytest.raises(InvalidStatus) as refused, graph.viewer(**options):
        pass
    response = refused.value.response
    assert response.status_code == (400 if "name" in options else 403)
    assert b"expected foxglove.sdk.v1" in response.body or b"may not control this robot" in response.body


def test_browser_that_only_looks_is_told_what_this_is(graph: Graph):
    with socket.create_connection(("127.0.0.1", graph.port)) as browser:
        browser.sendall(b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n")
        answer = b"".join(iter(lambda: browser.recv(4096), b""))
    assert answer.startswith(b"HTTP/1.1 426 ") and b"Open connection, Foxglove WebSocket" in answer


def test_half_a_request_and_too_long_a_one_do_no_harm(graph: Graph):
    for data in (b"GET /", b"\0" * 100, b"GET / HTTP/1.1\r\n" + b"a: b\r\n" * 50000):
        with socket.create_connection(("127.0.0.1", graph.port)) as browser:
            browser.sendall(data)
    with graph.viewer() as viewer:
        assert viewer.call("/stop").success


def ended(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, str(SCRIPTS / "bridge.py"), *arguments], capture_output=True, text=True, check=False
    )


def test_port_that_is_taken_ends_the_bridge_with_a_clear_word(graph: Graph):
    done = ended("--port", str(graph.port))
    assert done.returncode == 2
    assert f"Port {graph.port} of 127.0.0.1 cannot be had: Address already in use" in done.stderr
    assert "--port" in done.stderr and "Traceback" not in done.stderr


def test_port_that_is_none_is_refused():
    done = ended("--port", "70000")
    assert done.returncode == 2 and "expected 0 to 65535" in done.stderr


def test_opening_to_all_networks_says_what_that_means(graph: Graph):
    done = ended("--lan", "--port", str(graph.port))
    assert "there is no password, and nothing is encrypted" in done.stdout
    assert done.returncode == 2  # the port is taken on one of them
