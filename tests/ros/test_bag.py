"""Recordings, read back by an independent reader."""

from __future__ import annotations

import io
import subprocess
import sys
import time
from pathlib import Path

import pytest
import yaml
from mcap.records import Message
from mcap.stream_reader import StreamReader
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader

from tulip_msgs.msg import MotionState, WorldState
from tulip_ros import bag, topics
from tulip_ros.errors import BadInputError
from tulip_ros.raw_topic import Taken
from tulip_ros.recorder_node import RecorderNode, RecorderParameters
from tulip_ros.run import session
from tulip_ros.time import header

COUNT = 40
PUBLISHER = f"""
import time
from tulip_msgs.msg import GameState, MotionState
from sensor_msgs.msg import Image
from tulip_ros import topics
from tulip_ros.run import ComponentNode, session
from tulip_ros.time import header

with session(lambda: ComponentNode("motion", namespace="striker"), ["test"]) as (node, spin):
    senders = [node.sender(t) for t in (topics.MOTION_STATE, topics.CAMERA_IMAGE, topics.GAME_STATE)]
    extra = node.create_publisher(GameState, "unplanned", 10)
    publishers = [*senders, extra]
    deadline = time.monotonic() + 20
    while not all(p.get_subscription_count() for p in publishers) and time.monotonic() < deadline:
        spin(0.02)
    senders[2].publish(GameState(header=header(7), version=7, seconds_remaining=600))
    extra.publish(GameState(version=8))
    for i in range({COUNT}):
        senders[0].publish(MotionState(header=header(i + 1), phase=i / {COUNT}, reason="turf"))
        if i % 10 == 0:
            image = Image(header=header(i + 1), height=480, width=640, encoding="bgr8", step=1920)
            image.data.frombytes(bytes([i]) * (480 * 1920))
            senders[1].publish(image)
        spin(0.01)
    for _ in range(10):
        spin(0.05)
"""


@pytest.mark.ros
def test_everything_published_is_read_back_by_another_reader(ros_domain: int, tmp_path: Path):
    settings = RecorderParameters(path=str(tmp_path / "trial"), exclude=("/rosout",), pictures="raw", picture_rate=0.0)
    with session(lambda: RecorderNode(settings, "striker"), ["test"]) as (node, spin):
        assert node.bag is not None
        publisher = subprocess.Popen([sys.executable, "-c", PUBLISHER])
        deadline = time.monotonic() + 40
        while publisher.poll() is None and time.monotonic() < deadline:
            spin(0.05)
        assert publisher.wait(5) == 0
        for _ in range(20):
            spin(0.02)
    with AnyReader([tmp_path / "trial"]) as reader:
        kinds = {each.topic: each.msgtype for each in reader.connections}
        read = [
            (connection.topic, reader.deserialize(raw, connection.msgtype)) for connection, _, raw in reader.messages()
        ]
    assert kinds["/striker/motion_state"] == topics.MOTION_STATE.type_name
    assert kinds["/striker/unplanned"] == topics.GAME_STATE.type_name
    assert "/rosout" not in kinds
    motion = [message for topic, message in read if topic == "/striker/motion_state"]
    assert [message.header.stamp.nanosec for message in motion] == list(range(1, COUNT + 1))
    assert motion[20].phase == 0.5 and motion[20].reason == "turf" and motion[20].zmp.shape == (2,)
    images = [message for topic, message in read if topic == "/striker/camera/image_raw"]
    assert [int(image.data[-1]) for image in images] == [0, 10, 20, 30]
    assert [m.seconds_remaining for t, m in read if t == "/striker/game_state"] == [600]


def write_states(recording: bag.Bag, count: int) -> list[bytes]:
    recording.add_topic("/world_state", "tulip_msgs/msg/WorldState", topics.STATE)
    written = []
    for index in range(count):
        data = serialize_message(WorldState(header=header(index), robot_pose=[index, 0.0, 0.0]))
        recording.write("/world_state", data, 1_000_000_000 + index)
        written.append(data)
    return written


def written_beside(recording: bag.Bag) -> bytes:
    """Return the first file once the thread that writes it has written the chunk."""
    deadline = time.monotonic() + 10.0
    while len(recording.path.read_bytes()) < 100 and time.monotonic() < deadline:
        time.sleep(0.01)
    return recording.path.read_bytes()


def test_what_was_flushed_is_readable_without_an_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    recording = bag.Bag(tmp_path / "killed")
    monkeypatch.setattr(bag, "FLUSH", 0.0)
    written = write_states(recording, 3)
    recording.flush()
    data = written_beside(recording)
    records = []
    reader = StreamReader(io.BytesIO(data))
    try:
        for record in reader.records:
            records.append(record)
    except Exception as error:  # the file has no end, and the reader says so in its own way
        assert type(error).__name__ in ("EndOfFile", "McapError", "InvalidMagic", "RecordLengthLimitExceeded", "error")
    assert [record.data for record in records if isinstance(record, Message)] == written
    recording.close()


def test_metadata_counts_messages_and_spans_their_time(tmp_path: Path):
    recording = bag.Bag(tmp_path / "states")
    write_states(recording, 5)
    recording.close()
    information = yaml.safe_load((tmp_path / "states" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert information["message_count"] == 5
    assert information["duration"]["nanoseconds"] == 4
    assert information["relative_file_paths"] == ["states.mcap"]
    assert information["topics_with_message_count"][0]["topic_metadata"]["type"] == "tulip_msgs/msg/WorldState"


def test_recording_is_not_written_over(tmp_path: Path):
    (tmp_path / "old.mcap").touch()
    with pytest.raises(BadInputError, match="is not empty"):
        bag.Bag(tmp_path)


def test_unwritable_path_is_refused(tmp_path: Path):
    (tmp_path / "file").touch()
    with pytest.raises(BadInputError, match="cannot be written"):
        bag.Bag(tmp_path / "file" / "bag")


def test_full_disk_is_refused_and_leaves_no_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(bag.Bag, "has_space", lambda self: False)
    with pytest.raises(BadInputError, match="MiB are free"):
        bag.Bag(tmp_path / "bag")
    assert list((tmp_path / "bag").iterdir()) == []


def test_topics_are_chosen_by_whole_name():
    settings = RecorderParameters(include=(r".*/motion.*", "/clock"), exclude=(r".*/motion_debug",))
    chosen = [name for name in ("/a/motion_state", "/a/motion_debug", "/clock", "/clock2") if settings.wants(name)]
    assert chosen == ["/a/motion_state", "/clock"]
    assert not RecorderParameters().wants("/kick/_action/status")
    with pytest.raises(ValueError, match="no regular expression"):
        RecorderParameters(include=("(",))


@pytest.mark.ros
def test_services_start_and_stop_recordings(ros_domain: int, tmp_path: Path):
    settings = RecorderParameters(start=False, folder=str(tmp_path))
    with session(lambda: RecorderNode(settings), ["test"]) as (node, _):
        start, stop = topics.START_RECORDING.type, topics.STOP_RECORDING.type
        assert not node.on_stop(stop.Request(), stop.Response()).success
        begun = node.on_start(start.Request(path=str(tmp_path / "one")), start.Response())
        assert begun.success and begun.message == str(tmp_path / "one" / "one.mcap")
        again = node.on_start(start.Request(), start.Response())
        assert not again.success and "stop it first" in again.message
        source = node.inputs["/motion_state"]
        node.write([(source, Taken(2, 1, serialize_message(MotionState()), 1))])
        ended = node.on_stop(stop.Request(), stop.Response())
        assert ended.success and "1 messages" in ended.message
        refused = node.on_start(start.Request(path=str(tmp_path / "one")), start.Response())
        assert not refused.success and "not empty" in refused.message
