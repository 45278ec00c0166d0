"""log.py: what it tells of recordings, parts of them and several in one, and what it says about bad input."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import log as log_tool
import pytest
import yaml
from rclpy.serialization import serialize_message
from recordings_to_view import GAP, MS, joint_position, write
from rosbags.highlevel import AnyReader
from std_msgs.msg import String
from typer.testing import CliRunner, Result

from tulip_msgs.msg import GameState
from tulip_ros import topics
from tulip_ros.bag import Bag
from tulip_ros.log_file import Log


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("log") / "trial")


def run(*arguments: object) -> Result:
    return CliRunner().invoke(log_tool.app, [str(argument) for argument in arguments])


def contents(path: Path) -> list[tuple[str, int, bytes]]:
    with Log(path) as log:
        return [(record.topic.name, record.log_time, record.data) for record in log.records()]


def test_info_tells_duration_and_rates(recording: Path):
    result = run("info", recording)
    assert result.exit_code == 0
    assert "3.98 s" in result.stdout and "yes, with its index" in result.stdout
    joint_states = next(line for line in result.stdout.splitlines() if "/joint_states" in line)
    assert joint_states.split()[1:] == ["399", "100.3"]


def test_topics_tells_the_largest_gap_and_where_it_is(recording: Path):
    result = run("topics", recording)
    truth = next(line for line in result.stdout.splitlines() if "/ground_truth" in line)
    cells = [cell.strip() for cell in truth.split("│")][1:]
    assert cells[0] == "/ground_truth" and cells[4] == "1.400"  # from 1.2 s to 2.6 s
    assert float(cells[5]) == pytest.approx(GAP[0] / 1000 - 0.01, abs=0.006)


def test_cat_prints_fields_as_json_lines_within_a_time(recording: Path):
    fields = "header.stamp.nanosec,position.2"
    result = run("cat", recording, "-t", "joint_states", "--fields", fields, "--json", "--from", "0.99", "--to", "1.03")
    lines = [json.loads(line) for line in result.stdout.splitlines()]
    assert [line["log_time"] for line in lines] == [1000 * MS, 1010 * MS, 1020 * MS, 1030 * MS]
    assert [line["position.2"] for line in lines] == [joint_position(ms, 2) for ms in (1000, 1010, 1020, 1030)]


def test_cat_prints_whole_messages_as_yaml(recording: Path):
    result = run("cat", recording, "-t", "/game_state")
    found = list(yaml.safe_load_all(result.stdout))
    assert [each["phase"] for each in found if each] == [GameState.SET, GameState.PLAYING]


def test_nan_is_null_in_json(tmp_path: Path):
    bag = Bag(tmp_path / "nan")
    bag.add_topic("/odometry", topics.ODOMETRY.type_name, topics.ODOMETRY.quality)
    message = topics.ODOMETRY.message()
    message.pose.pose.position.x = float("nan")
    bag.write("/odometry", serialize_message(message), 1)
    bag.close()
    result = run("cat", tmp_path / "nan", "--json", "--fields", "pose.pose.position.x")
    assert json.loads(result.stdout)["pose.pose.position.x"] is None


def test_cut_holds_what_was_latched_before_and_the_messages_of_its_time_and_topics(recording: Path, tmp_path: Path):
    part = tmp_path / "part"
    result = run("cut", recording, "-o", part, "-t", "world_state", "-t", "game*", "--from", "0.5", "--to", "2")
    assert result.exit_code == 0, result.stderr
    wanted = [
        each
        for each in contents(recording)
        if each[0] in ("/world_state", "/game_state") and 510 * MS <= each[1] < 2010 * MS
    ]
    earlier = [data for name, at, data in contents(recording) if name == "/game_state" and at < 510 * MS]
    latched = ("/game_state", 510 * MS, earlier[-1])
    assert wanted and contents(part) == [latched, *wanted]


def test_merged_parts_are_the_whole_for_another_reader_too(recording: Path, tmp_path: Path):
    for name, *choice in (("a", "--to", "0.3"), ("b", "--from", "0.3")):  # before anything is latched
        assert run("cut", recording, "-o", tmp_path / name, *choice).exit_code == 0
    assert run("merge", tmp_path / "b", tmp_path / "a", "-o", tmp_path / "ab").exit_code == 0
    assert sorted(contents(tmp_path / "ab")) == sorted(contents(recording))
    with AnyReader([tmp_path / "ab"]) as reader:
        times = [stamp for _, stamp, _ in reader.messages()]
        assert times == sorted(times) and len(times) == len(contents(recording))


def test_notes_and_attachments_go_along(tmp_path: Path):
    bag = Bag(tmp_path / "noted")
    bag.add_topic("/referee/report", topics.REPORT.type_name, topics.REPORT.quality)
    bag.write("/referee/report", serialize_message(String(data="{}")), 5)
    bag.note("versions", {"git": "abc"})
    bag.attach("robot.yaml", "text/plain", b"links: []")
    bag.close()
    assert run("cut", tmp_path / "noted", "-o", tmp_path / "cut").exit_code == 0
    with Log(tmp_path / "cut") as log:
        assert log.metadata == {"versions": {"git": "abc"}}
        assert [(each.name, bytes(each.data)) for each in log.attachments()] == [("robot.yaml", b"links: []")]
        assert "transient_local" in log.topics["/referee/report"].quality


def test_nothing_is_overwritten_without_force(recording: Path, tmp_path: Path):
    part = tmp_path / "part"
    assert run("cut", recording, "-o", part, "-t", "game_state").exit_code == 0
    before = contents(part)
    result = run("cut", recording, "-o", part, "-t", "world_state")
    assert result.exit_code == 2 and "--force" in result.stderr and contents(part) == before
    assert run("cut", recording, "-o", part, "-t", "world_state", "--force").exit_code == 0
    assert {name for name, _, _ in contents(part)} == {"/world_state"}
    assert not (tmp_path / "part.old").exists()


def test_force_replaces_no_folder_that_holds_other_things(recording: Path, tmp_path: Path):
    (tmp_path / "thesis.txt").write_text("years of work")
    result = run("cut", recording, "-o", tmp_path, "--force")
    assert result.exit_code == 2 and "thesis.txt" in result.stderr
    assert (tmp_path / "thesis.txt").read_text() == "years of work"


def test_a_recording_is_not_cut_into_itself(recording: Path):
    before = contents(recording)
    result = run("cut", recording, "-o", recording, "--force")
    assert result.exit_code == 2 and "read here itself" in result.stderr and contents(recording) == before


def test_an_old_recording_stays_when_the_new_one_fails(recording: Path, tmp_path: Path):
    part = tmp_path / "part"
    assert run("cut", recording, "-o", part, "-t", "game_state").exit_code == 0
    before = contents(part)
    damaged = tmp_path / "damaged.mcap"
    data = bytearray((recording / "trial.mcap").read_bytes())
    data[2000] ^= 0xFF  # in the first chunk; the index at the end is whole
    damaged.write_bytes(data)
    result = run("cut", damaged, "-o", part, "--force")
    assert result.exit_code == 2 and "recover.py" in result.stderr
    assert contents(part) == before


def test_nothing_is_left_where_the_disk_is_full(recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(shutil, "disk_usage", lambda path: shutil._ntuple_diskusage(10**9, 10**9 - 10**6, 10**6))
    result = run("cut", recording, "-o", tmp_path / "part")
    assert result.exit_code == 2 and "are free at" in result.stderr
    assert not (tmp_path / "part").exists()


def test_topics_of_two_types_are_not_merged(recording: Path, tmp_path: Path):
    bag = Bag(tmp_path / "other")
    bag.add_topic("/world_state", topics.REPORT.type_name, topics.REPORT.quality)
    bag.write("/world_state", serialize_message(String(data="no pose")), 5)
    bag.close()
    result = run("merge", recording, tmp_path / "other", "-o", tmp_path / "both")
    assert result.exit_code == 2 and "/world_state is tulip_msgs/msg/WorldState" in result.stderr
    assert not (tmp_path / "both").exists()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("-t", "world_stat"), "Did you mean /world_state"),
        (("-t", "world_state", "--fields", "robot_pos"), "robot_pose"),
        (("-t", "world_state", "--fields", "robot_pose.7"), "there are 3 elements"),
        (("--from", "99"), "--from is 99 s; expected at most 3.98 s"),
        (("--from", "2", "--to", "1"), "--to is 1 s; expected more than --from"),
    ],
)
def test_a_wrong_choice_is_told_with_what_is_there(recording: Path, arguments: tuple[str, ...], said: str):
    result = run("cat", recording, *arguments)
    assert result.exit_code == 2 and said in result.stderr


def test_bad_files_are_told_apart(recording: Path, tmp_path: Path):
    whole = (recording / "trial.mcap").read_bytes()
    for name, content, said in (
        ("text.mcap", b"hello, this is no recording", "is no MCAP file"),
        ("empty.mcap", b"", "is empty"),
        ("cut.mcap", whole[: len(whole) // 2], "recover.py"),
    ):
        (tmp_path / name).write_bytes(content)
        for command in (("info",), ("topics",), ("cat",)):
            result = run(*command, tmp_path / name)
            assert result.exit_code == 2 and said in result.stderr, (name, command)
    assert "There is no recording" in run("info", tmp_path / "missing").stderr
