"""Recordings whose types are not the ones that are installed here."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from rclpy.serialization import serialize_message
from recordings_to_view import MS, add, messages
from std_msgs.msg import String

from tulip_msgs.msg import ObjectEstimate, WorldState
from tulip_ros import schemas, topics
from tulip_ros.bag import Bag
from tulip_ros.log_file import Log
from tulip_view.older_messages import installed, told
from tulip_view.recording import read
from tulip_view.report.build import WANTED, make_report
from tulip_view.tables import make_table, regular_times, sources_of, topics_of


class Older:
    """What a decoder makes of a message: an object with its fields, here with some of them."""

    def __init__(self, **fields: object) -> None:
        self.__slots__ = tuple(fields)
        for name, value in fields.items():
            setattr(self, name, value)


def test_fields_that_both_have_are_taken_over_and_the_others_named():
    older = Older(
        robot_pose=[1.0, 2.0, 0.5],
        ball_known=True,
        ball=Older(position=[0.3, 0.1], age=0.25),
        opponents=[Older(position_in_map=[3.0, -1.0])],
        robot_covariance="not what it is today",
    )
    lacking: set[str] = set()
    found = installed(older, WorldState, lacking)
    assert isinstance(found, WorldState) and isinstance(found.ball, ObjectEstimate)
    assert found.robot_pose == pytest.approx([1.0, 2.0, 0.5]) and found.ball_known
    assert found.ball.position == pytest.approx([0.3, 0.1]) and found.ball.age == pytest.approx(0.25)
    assert isinstance(found.opponents[0], ObjectEstimate)
    assert found.opponents[0].position_in_map == pytest.approx([3.0, -1.0])
    assert {"robot_covariance", "header", "ball.confidence"} <= lacking
    assert not lacking & {"robot_pose", "ball_known", "ball.position", "ball.age"}
    serialize_message(found)  # whole


def test_a_message_of_the_installed_type_stays_what_it_is():
    message, lacking = WorldState(), set[str]()
    assert installed(message, WorldState, lacking) is message and not lacking


def test_many_fields_are_told_by_their_number():
    assert told({"b", "a"}) == "a, b"
    assert told(set("abcdefgh")) == "a, b, c, d, e, f and 2 more"


@pytest.fixture
def older(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A recording of a time when world states had no field `ball_known`, and `decision` was plain text."""
    bag = Bag(tmp_path / "older")
    for milliseconds in range(10, 2000, 10):
        for topic, message in messages(milliseconds):
            if topic.name != topics.DECISION.name:
                add(bag, topic, message, milliseconds)
        bag.add_topic("/decision", "std_msgs/msg/String", topics.DECISION.quality)
        bag.write("/decision", serialize_message(String(data="dribble")), milliseconds * MS)
    bag.close()
    # As if the type had got another comment since: the recording's own definition is then used to decode.
    known = schemas.definition
    monkeypatch.setattr(
        schemas, "definition", lambda name: known(name) + ("# new\n" if name.endswith("WorldState") else "")
    )
    return tmp_path / "older"


def test_a_report_reads_what_fits_and_says_what_does_not(older: Path):
    with Log(older) as log:
        report = make_report(log, "", lambda number: None)
    assert report.remarks == [
        "/decision is std_msgs/msg/String, where tulip_msgs/msg/Decision was expected; it was not read."
    ]
    assert "errors" in {section.key for section in report.sections}
    about = report.sections[-1]
    assert report.remarks[0] in about.words


def test_a_table_of_an_older_recording_is_that_of_its_messages(older: Path):
    sources = sources_of(["world", "decisions"])
    with Log(older) as log:
        recording = read(log, "", topics_of(sources))
        assert all(isinstance(message, WorldState) for message in recording.tracks["world_state"].messages)
        table = make_table(recording, sources, regular_times(recording, 20.0))
    assert table["robot_x_m"] == pytest.approx(table["time_s"], abs=1e-9)  # 1 m/s, as they were written
    assert {line.split(":")[0] for line in table.left_out} == {"decision"}
    assert np.isfinite(table["robot_x_m"]).all() and set(WANTED) >= {"decision", "world_state"}
