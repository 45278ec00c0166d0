"""What is played when: a replay's clock, passage and topics, without ROS."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from types import SimpleNamespace

import pytest
from rclpy.serialization import deserialize_message, serialize_message

from tulip_msgs.msg import GameState, MotionState
from tulip_ros import cdr, schemas, topics
from tulip_ros.bag import Bag
from tulip_ros.errors import BadInputError
from tulip_ros.latched import quality_of
from tulip_ros.log_file import Log, LoggedTopic
from tulip_ros.replay import CLOCK_PERIOD, Passage, ReplayParameters, Schedule, playable
from tulip_ros.time import header

MS = 1_000_000


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    bag = Bag(tmp_path / "run")
    for topic in (topics.MOTION_STATE, topics.GAME_STATE):
        bag.add_topic(f"/{topic.name}", topic.type_name, topic.quality)
    bag.write("/game_state", serialize_message(GameState(version=7)), 0)
    for index in range(51):
        at = index * 20 * MS
        bag.write("/motion_state", serialize_message(MotionState(header=header(at), reason="x" * (index % 8))), at)
    bag.close()
    return tmp_path / "run"


def test_due_times_follow_from_the_first_alone_and_the_rate():
    schedule = Schedule(first=5_000, rate=4.0, now=100)
    assert [schedule.due(5_000 + time) for time in (0, 4, 400)] == [100, 101, 200]
    schedule.change_rate(1.0, 200)
    assert schedule.due(5_500) == 300
    assert schedule.position(250) == 5_450


def test_a_pause_holds_what_is_later_and_a_step_lets_its_part_pass():
    schedule = Schedule(first=0, rate=1.0, now=0)
    schedule.pause(100)
    assert schedule.due(100) == 100 and schedule.due(101) is None
    schedule.step(20)
    assert schedule.due(120) is not None and schedule.due(121) is None
    schedule.resume(1_000)
    assert schedule.due(150) == 1_030


def test_a_passage_has_its_part_and_the_clock_between(recording: Path):
    with Log(recording) as log:
        passage = Passage(log, ["/motion_state"], start=0.5, duration=0.2)
        entries = list(passage)
    times = [time for time, _ in entries]
    assert times == sorted(times)
    assert [time for time, record in entries if record is not None] == list(range(500 * MS, 700 * MS, 20 * MS))
    assert [time for time, record in entries if record is None][:3] == [500 * MS + i * CLOCK_PERIOD for i in range(3)]


def test_what_was_latched_before_the_passage_is_known_at_its_beginning(recording: Path):
    with Log(recording) as log:
        before = Passage(log, ["/motion_state", "/game_state"], start=0.5, duration=0.0).before()
    assert [record.topic.name for record in before] == ["/game_state"]


def test_a_start_beyond_the_end_and_topics_that_are_not_there_are_refused(recording: Path):
    with Log(recording) as log:
        with pytest.raises(BadInputError, match=r"Start is 9\.0 s; recording .* is 1\.0 s long"):
            Passage(log, ["/motion_state"], 9.0, 0.0)
        with pytest.raises(BadInputError, match=r"Nothing of .* its topics are /game_state, /motion_state"):
            Passage(log, [], 0.0, 0.0)


def test_types_that_are_missing_or_have_changed_are_named():
    given = (
        LoggedTopic("/a", "tulip_msgs/msg/GameState", schemas.definition("tulip_msgs/msg/GameState"), 1),
        LoggedTopic("/b", "tulip_msgs/msg/GameState", "uint8 other\n", 1),
        LoggedTopic("/c", "elsewhere_msgs/msg/Thing", "uint8 x\n", 1),
    )
    names, refused = playable(SimpleNamespace(topics={topic.name: topic for topic in given}))  # type: ignore[arg-type]
    assert names == ["/a"]
    assert "was another one" in refused["/b"] and "elsewhere_msgs/msg/Thing is not installed" in refused["/c"]


def test_quality_is_this_projects_own_or_as_noted():
    assert quality_of(LoggedTopic("/keeper/game_state", "tulip_msgs/msg/GameState", "", 1)).latched
    noted = "- {history: keep_last, depth: 3, durability: transient_local}"
    assert str(quality_of(LoggedTopic("/map", "std_msgs/msg/String", "", 1, noted))) == "reliable, last 3, latched"
    assert not quality_of(LoggedTopic("/map", "std_msgs/msg/String", "", 1, "- {depth")).latched


@pytest.mark.parametrize(
    ("wrong", "message"),
    [({"rate": 0.0}, "rate is 0.0"), ({"start": -1.0}, "start is"), ({"include": ("(",)}, "no reg")],
)
def test_settings_out_of_range_are_refused(wrong: dict, message: str):
    with pytest.raises(ValueError, match=message):
        ReplayParameters(**wrong)


def test_messages_of_one_content_are_equal_once_their_gaps_are_cleared():
    message = MotionState(header=header(5, "odom"), phase=0.25, reason="turf", notes=["a", "bcd"])
    data = serialize_message(message)
    cleared = cdr.without_gaps("tulip_msgs/msg/MotionState", data)
    # stamp 8, length 4, "odom\0" 5, mode 1, support 1: the gap before the phase begins at 19, the head not counted
    spoilt = bytearray(data)
    spoilt[4 + 19 : 4 + 24] = b"12345"
    assert cdr.without_gaps("tulip_msgs/msg/MotionState", bytes(spoilt)) == cleared
    assert len(cleared) == len(data)
    # the middleware fills up to a multiple of four
    assert cdr.without_gaps("tulip_msgs/msg/MotionState", data + b"\1\2\3") == cleared
    other = serialize_message(MotionState(header=header(5, "odom"), phase=0.25, reason="tarf", notes=["a", "bcd"]))
    assert cdr.without_gaps("tulip_msgs/msg/MotionState", other) != cleared
    with pytest.raises(ValueError, match="are no tulip_msgs/msg/MotionState"):
        cdr.without_gaps("tulip_msgs/msg/MotionState", data[:40])


@pytest.mark.parametrize("topic", topics.TOPICS, ids=lambda topic: topic.name)
def test_gaps_of_every_topics_messages_are_known(topic: topics.Topic):
    data = serialize_message(topic.message())
    cleared = cdr.without_gaps(topic.type_name, data)
    assert len(cleared) <= len(data)
    assert deserialize_message(cleared, topic.message) == topic.message()


def test_messages_come_in_the_order_of_time_from_overlapping_chunks(tmp_path: Path):
    bag = Bag(tmp_path / "late")
    bag.add_topic("/motion_state", topics.MOTION_STATE.type_name, topics.MOTION_STATE.quality)
    times = [(index * 7919) % 5_000 for index in range(5_000)]  # each once, far from in order, some chunks
    for time in times:
        bag.write("/motion_state", serialize_message(MotionState(header=header(time))), time)
    bag.close()
    with Log(tmp_path / "late") as log:
        assert [record.log_time for record in log.records()] == sorted(times)
        assert [record.log_time for record in log.records(None, 100, 103)] == [100, 101, 102]
        assert dataclasses.astuple(next(log.records()))[1] == 0
