"""Recordings that explain themselves: notes, parameters, splitting, lost messages, full disks, bad files."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import full_disk
import pytest
import yaml
from mcap.reader import make_reader
from mcap.writer import Writer
from rclpy.serialization import serialize_message
from rosbags.highlevel import AnyReader
from std_msgs.msg import String

import tulip_description
from tulip_description.planar import Pose2D
from tulip_msgs.msg import GameState, MotionState
from tulip_ros import log_notes, topics
from tulip_ros.bag import Bag, Split
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_ros.log_index import DamagedLogError
from tulip_ros.lost_messages import LostMessages
from tulip_ros.plan import read_parameters
from tulip_ros.recorder_node import RecorderNode, RecorderParameters
from tulip_ros.recovery import recover
from tulip_ros.run import ComponentNode, session
from tulip_sim.lockstep_notes import explain_match, explain_trial
from tulip_sim.match_rules import NAMESPACES
from tulip_sim.match_settings import MatchSettings

SECOND = 1_000_000_000


def write_split(folder: Path, split: Split, count: int) -> Bag:
    """Write two states of the game at the beginning, then a state of motion every 0.1 s."""
    bag = Bag(folder, split, free=0)
    bag.note("recording", {"seed": "3"})
    bag.attach("robot.yaml", "text/yaml", b"mass: 23")
    bag.add_topic("/game_state", "tulip_msgs/msg/GameState", topics.LATCHED)
    bag.add_topic("/motion_state", "tulip_msgs/msg/MotionState", topics.CONTROL)
    for version in (1, 2):
        bag.write("/game_state", serialize_message(GameState(version=version)), 0)
    for number in range(count):
        data = serialize_message(MotionState(phase=number / count, reason=os.urandom(2000).hex()))
        bag.write("/motion_state", data, number * SECOND // 10)
        if number % 50 == 0:
            time.sleep(0.01)  # messages come over time: what counts is how much the writer has written
    bag.close()
    return bag


def test_each_file_of_a_split_recording_explains_itself(tmp_path: Path):
    bag = write_split(tmp_path / "match", Split(seconds=1.0), 35)
    assert [path.name for path in bag.paths] == [f"match_{number}.mcap" for number in range(4)]
    for number, path in enumerate(bag.paths):
        with open(path, "rb") as stream:
            reader = make_reader(stream, validate_crcs=True)
            assert {each.name: each.metadata for each in reader.iter_metadata()}["recording"] == {"seed": "3"}
            assert [each.data for each in reader.iter_attachments()] == [b"mass: 23"]
            first = next(channel.topic for _, channel, _ in reader.iter_messages())
            assert first == "/game_state"
        if number:
            with Log(path) as log:
                [game] = [log.decode(record) for record in log.records(["/game_state"])]
                assert game.version == 2


def test_split_recording_reads_as_if_it_were_one(tmp_path: Path):
    write_split(tmp_path / "one", Split(), 35)
    write_split(tmp_path / "many", Split(seconds=1.0), 35)
    with Log(tmp_path / "one") as one, Log(tmp_path / "many") as many:
        assert len(many.files) == 4 and [file.name for file in one.files] == ["one.mcap"]
        assert many.span == one.span and many.metadata == one.metadata
        assert {name: topic.messages for name, topic in many.topics.items()} == {"/game_state": 2, "/motion_state": 35}
        order = [(record.topic.name, record.log_time, record.sequence) for record in one.records()]
        assert [(record.topic.name, record.log_time, record.sequence) for record in many.records()] == order
        assert len(list(many.attachments())) == 1


def test_metadata_lists_the_files_with_their_own_counts_and_times(tmp_path: Path):
    write_split(tmp_path / "many", Split(seconds=1.0), 35)
    content = yaml.safe_load((tmp_path / "many" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert content["relative_file_paths"] == [f"many_{number}.mcap" for number in range(4)]
    assert [each["message_count"] for each in content["files"]] == [12, 11, 11, 6]
    assert content["files"][1]["starting_time"]["nanoseconds_since_epoch"] == SECOND
    assert content["message_count"] == 40 and content["duration"]["nanoseconds"] == 34 * SECOND // 10
    with AnyReader([tmp_path / "many"]) as reader:
        assert sum(1 for _ in reader.messages()) == 40


def test_splitting_by_size_begins_a_file_once_one_is_so_large(tmp_path: Path):
    bag = write_split(tmp_path / "large", Split(size=1_000_000), 1200)
    sizes = [path.stat().st_size for path in bag.paths]
    assert len(sizes) >= 2 and all(size >= 1_000_000 for size in sizes[:-1]) and max(sizes) < 3_000_000
    with Log(bag.folder) as log:
        assert log.topics["/motion_state"].messages == 1200
    with pytest.raises(ValueError, match="expected a finite number >= 0"):
        Split(seconds=-1.0)


def test_publish_times_are_kept(tmp_path: Path):
    bag = Bag(tmp_path / "times", free=0)
    bag.add_topic("/words", "std_msgs/msg/String", topics.STATE)
    bag.write("/words", serialize_message(String(data="x")), 2000, 1500)
    bag.close()
    with open(bag.path, "rb") as stream:
        [(_, _, message)] = make_reader(stream).iter_messages()
    assert (message.log_time, message.publish_time) == (2000, 1500)


def test_recording_without_compression_is_read_by_other_readers(tmp_path: Path):
    bag = Bag(tmp_path / "plain", free=0, compression="none")
    bag.add_topic("/words", "std_msgs/msg/String", topics.STATE)
    for number in range(3):
        bag.write("/words", serialize_message(String(data="sand" * 1000)), number)
    bag.close()
    assert bag.path.stat().st_size > 12000
    with AnyReader([bag.folder]) as reader:
        [connection] = reader.connections
        assert [reader.deserialize(raw, connection.msgtype).data for _, _, raw in reader.messages()] == [
            "sand" * 1000
        ] * 3


@pytest.mark.parametrize("robots", [1, 2])
def test_lockstep_notes_are_parameter_files_that_the_programs_read(tmp_path: Path, robots: int):
    bag = Bag(tmp_path / "bag", free=0)
    if robots == 1:
        explain_trial(bag, 5, "trial", Pose2D(-1.0, 0.5, 0.0), None, "dribble_and_kick")
    else:
        explain_match(bag, 5, MatchSettings())
    bag.close()
    with Log(bag.folder) as log:
        assert log.metadata["recording"]["seed"] == "5" and log.metadata["recording"]["numpy"]
        files = {each.name: each.data for each in log.attachments()}
        assert files["robot.yaml"] == Path(tulip_description.__file__).with_name("robot.yaml").read_bytes()
        found = log_notes.parameters_of(log)
    assert found["driver"]["seed"] == 5
    assert {name for name in found if name.endswith("motion")} == (
        {"motion"} if robots == 1 else {f"{namespace}/motion" for namespace in NAMESPACES}
    )
    for name, data in files.items():
        if name.startswith(log_notes.PARAMETERS):
            (tmp_path / "read.yaml").write_bytes(data)
            [(node, values)] = read_parameters(tmp_path / "read.yaml").items()
            assert name.endswith(f"{node}.yaml") and values


def test_missing_messages_are_counted_by_their_numbers():
    numbers = LostMessages()

    def one() -> int:
        return 1

    assert [numbers.see(each, one) for each in (5, 6, 7, 10, 11)] == [0, 0, 0, 2, 0]
    assert numbers.see(1, one) == 0  # the publisher was started again
    assert numbers.see(3, one) == 1 and numbers.lost == 3
    two = LostMessages()
    assert [two.see(each, lambda: 2) for each in (1, 100, 2, 101, 102, 3, 105, 5)] == [0, 0, 0, 0, 0, 0, 2, 1]
    several = LostMessages()
    heard = [each for number in range(1, 50) for each in (number, 1000 + number)]
    assert sum(several.see(each, lambda: 2) for each in heard) == 0
    assert several.see(1, lambda: 2) == 0  # one of the two was started again
    assert [several.see(each, lambda: 2) for each in (1050, 2, 1051)] == [0, 0, 0]


FLOOD = """
import time
from tulip_msgs.msg import MotionState
from tulip_ros import topics
from tulip_ros.run import ComponentNode, session

with session(lambda: ComponentNode("motion"), []) as (node, spin):
    sender = node.sender(topics.MOTION_STATE)
    while not sender.get_subscription_count():
        spin(0.02)
    spin(0.5)
    for number in range(1000):
        sender.publish(MotionState(step_count=number))
        time.sleep(0.001)
    while True:
        spin(0.1)
"""


@pytest.mark.ros
def test_recorder_counts_what_it_lost_and_notes_the_parameters_of_nodes(ros_domain: int, tmp_path: Path):
    settings = RecorderParameters(path=str(tmp_path / "trial"), notes=("seed=4",))
    flood = subprocess.Popen([sys.executable, "-c", FLOOD])
    try:
        with session(lambda: RecorderNode(settings), []) as (node, spin):
            deadline = time.monotonic() + 40.0
            while node.bag is not None and node.bag.messages < 50 and time.monotonic() < deadline:
                spin(0.02)
            time.sleep(2.0)  # busy with something else, while messages come
            while not any("motion" in name for name in node.known) and time.monotonic() < deadline:
                spin(0.05)
            lost = node.lost["/motion_state"]
            told = node.end()
    finally:
        flood.kill()
        flood.wait()
    with Log(tmp_path / "trial") as log:
        steps = [log.decode(record).step_count for record in log.records(["/motion_state"])]
        assert lost > 100 and len(steps) + lost == 1000 - steps[0]
        assert log.metadata[log_notes.LOST]["/motion_state"] == str(lost) and f"{lost} more were lost" in told
        assert log.metadata["recording"]["seed"] == "4" and "git revision" in log.metadata["recording"]
        known = log_notes.parameters_of(log)
        assert known["motion"]["use_sim_time"] is False
        assert known["recorder"]["pictures"] == "compressed"


AWAITED = """
from tulip_ros.run import ComponentNode, session

with session(lambda: ComponentNode("motion"), []) as (node, spin):
    while True:
        spin(0.1)
"""


@pytest.mark.ros
def test_recorder_serves_once_it_hears_the_nodes_it_waits_for(ros_domain: int, tmp_path: Path):
    settings = RecorderParameters(path=str(tmp_path / "trial"), wait_for=("motion",))
    serves: list[bool] = []

    def look(node: RecorderNode) -> bool:
        serves.append("/start_recording" in dict(node.get_service_names_and_types()))
        return serves[-1]

    with session(lambda: RecorderNode(settings), []) as (node, spin):
        spin(1.0)
        assert not look(node) and "/motion" not in node.known
        awaited = subprocess.Popen([sys.executable, "-c", AWAITED])
        try:
            deadline = time.monotonic() + 15.0  # less than the recorder waits for a node that never comes
            while not look(node) and time.monotonic() < deadline:
                assert "/motion" not in node.known
                spin(0.05)
        finally:
            awaited.kill()
            awaited.wait()
        assert serves[-1] and "/motion" in node.known
        node.end()


@pytest.mark.ros
def test_recording_begun_later_begins_with_what_holds(ros_domain: int, tmp_path: Path):
    def make() -> RecorderNode:
        return RecorderNode(RecorderParameters(start=False, folder=str(tmp_path), include=("/game_state",)))

    with session(make, []) as (node, spin):
        sender = ComponentNode.sender(node, topics.GAME_STATE)
        sender.publish(GameState(version=9))
        deadline = time.monotonic() + 20.0
        while not node._latched and time.monotonic() < deadline:
            spin(0.05)
        node.begin(str(tmp_path / "later"))
        node.end()
    with Log(tmp_path / "later") as log:
        assert [log.decode(record).version for record in log.records(["/game_state"])] == [9]


def check_saved(folder: Path, taken: int) -> None:
    """All but the chunks that were under way are in the recording, which is mended elsewhere if it must be."""
    try:
        with Log(folder) as log:
            count = sum(1 for _ in log.records())
    except DamagedLogError:
        output = recover(folder, folder.parent.parent / "mended").output
        assert output is not None
        with Log(output) as log:
            assert log.metadata["recording"] == {"seed": "3"}
            count = sum(1 for _ in log.records())
    assert 0 < count <= taken


def fill_apart(*command: str) -> tuple[int, int, str]:
    """Fill a disk in a process of its own; return messages taken, bytes written, and why it ended."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    assert done.returncode == 0, done.stderr
    taken, size, *words = done.stdout.split()
    return int(taken), int(size), " ".join(words)


def test_a_file_that_must_not_grow_ends_with_a_whole_chunk(tmp_path: Path):
    folder = tmp_path / "disk" / "full"
    taken, size, why = fill_apart(sys.executable, full_disk.__file__, str(folder), "2000000")
    assert why == "File too large"
    assert size == (folder / "full.mcap").stat().st_size <= 2_000_000
    check_saved(folder, taken)


def can_mount() -> bool:
    return subprocess.run(["unshare", "-m", "true"], capture_output=True, check=False).returncode == 0


@pytest.mark.skipif(not can_mount(), reason="this user may not mount a small disk")
def test_a_full_disk_ends_the_recording_and_what_was_written_is_saved(tmp_path: Path):
    disk, keep = tmp_path / "disk", tmp_path / "keep"
    disk.mkdir()
    keep.mkdir()
    work = f'mount -t tmpfs -o size=3m none "{disk}" && "$0" "$1" "{disk}/full" && cp -r "{disk}/full" "{keep}"'
    taken, _, why = fill_apart("unshare", "-m", "sh", "-c", work, sys.executable, full_disk.__file__)
    assert why == "No space left on device"
    check_saved(keep / "full", taken)


def foreign(path: Path) -> None:
    """A file whose only topic is not of ROS."""
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="another")
        schema = writer.register_schema("thing", "jsonschema", b"{}")
        channel = writer.register_channel("/thing", "json", schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()


def unknown_type(path: Path, definition: bytes) -> None:
    """A file with one message of a type that is not installed."""
    with open(path, "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="ros2", library="another")
        schema = writer.register_schema("other_msgs/msg/Thing", "ros2msg", definition)
        channel = writer.register_channel("/thing", "cdr", schema)
        writer.add_message(channel, 1, serialize_message(String(data="hello")), 1)
        writer.finish()


def test_files_that_are_no_recordings_are_refused_in_words(tmp_path: Path):
    whole = write_split(tmp_path / "whole", Split(), 30).path.read_bytes()
    cases = {
        "text": (b"hello", "is no MCAP file; expected a recording"),
        "empty": (b"", "is empty"),
        "cut": (whole[: len(whole) * 2 // 3], r"python3 scripts/recover\.py"),
        "headless": (whole[:8], r"python3 scripts/recover\.py"),
    }
    for name, (content, words) in cases.items():
        path = tmp_path / f"{name}.mcap"
        path.write_bytes(content)
        with pytest.raises(BadInputError, match=words):
            Log(path)
        assert path.read_bytes() == content
    with pytest.raises(BadInputError, match="There is no recording"):
        Log(tmp_path / "none")
    (tmp_path / "folder").mkdir()
    with pytest.raises(BadInputError, match=r"expected a file that ends in \.mcap"):
        Log(tmp_path / "folder")


def test_topics_that_are_missing_or_of_unknown_types_do_no_harm(tmp_path: Path):
    write_split(tmp_path / "whole", Split(), 3)
    with Log(tmp_path / "whole") as log:
        assert list(log.records(["/nothing"])) == []
    foreign(tmp_path / "foreign.mcap")
    with Log(tmp_path / "foreign.mcap") as log:
        assert log.topics == {} and list(log.records()) == []
    unknown_type(tmp_path / "known.mcap", b"string data\n")
    with Log(tmp_path / "known.mcap") as log:
        [record] = log.records()
        assert log.decode(record).data == "hello"  # the recording itself knows the type
    unknown_type(tmp_path / "broken.mcap", b"strange_msgs/Nowhere data\n")
    with Log(tmp_path / "broken.mcap") as log:
        [record] = log.records()
        with pytest.raises(BadInputError, match="other_msgs/msg/Thing"):
            log.decode(record)


def test_recorder_refuses_wrong_settings_in_words():
    with pytest.raises(ValueError, match="expected one of compressed, raw, both, none"):
        RecorderParameters(pictures="jpg")
    with pytest.raises(ValueError, match=r"picture_rate is -1\.0; expected a finite number >= 0, and 0 for all"):
        RecorderParameters(picture_rate=-1.0)
    with pytest.raises(ValueError, match="compression is 'lz4'; expected one of zstd, none"):
        RecorderParameters(compression="lz4")
    with pytest.raises(ValueError, match="expected name=value"):
        RecorderParameters(notes=("seed",))
    assert not RecorderParameters().wants("/striker/camera/image_raw")
    assert RecorderParameters(pictures="raw").wants("/striker/camera/image_raw")
    assert not RecorderParameters(pictures="raw").wants("/camera/image_raw/compressed")
