"""Tables made from recordings: units, alignment in time, values, files."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path

import export as export_script
import numpy as np
import pyarrow.parquet as pq
import pytest
import typer
from recordings_to_view import DURATION, GAP, KICK_AT, add, joint_position, messages, write, yaw
from scipy.io import loadmat
from typer.testing import CliRunner, Result

from tulip_description.robot import JOINTS
from tulip_ros import topics
from tulip_ros.bag import Bag
from tulip_ros.errors import BadInputError
from tulip_ros.log_file import Log
from tulip_view.columns import SOURCES, UNITS
from tulip_view.recording import choose_robot, read, robots_in
from tulip_view.table_files import is_matlab_name
from tulip_view.tables import MOST_VALUES, Table, make_table, native_times, regular_times, sources_of, topics_of

app = typer.Typer()
app.command()(export_script.main)


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write(tmp_path_factory.mktemp("tables") / "trial")


def table(path: Path, groups: tuple[str, ...], rate: float | None = None, times_of: str | None = None) -> Table:
    sources = sources_of(groups)
    with Log(path) as log:
        found = read(log, choose_robot(log, None), topics_of(sources, times_of))
    times = regular_times(found, rate) if rate is not None else native_times(found, times_of or "")
    return make_table(found, sources, times)


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_every_column_has_its_unit_in_its_name_and_is_a_matlab_name():
    columns = [column for source in SOURCES for column in source.columns]
    names = [column.name for column in columns]
    assert len(set(names)) == len(names)
    assert all(is_matlab_name(name) for name in names)
    assert all(column.name.endswith(UNITS[column.unit]) for column in columns)
    assert {"left_hip_pitch_position_rad", "robot_x_m", "com_x_m"} <= set(names)
    # What has a unit's ending without a unit, or a length without one, was forgotten.
    plain = [column.name for column in columns if column.unit == "" and not column.name.startswith("seen_")]
    assert not [name for name in plain if re.search(r"_(x|y|z|yaw|m|rad|s|N|Nm|position|torque|force)$", name)]


def test_at_native_times_values_equal_the_messages(recording: Path):
    found = table(recording, ("joints",), times_of="joint_states")
    milliseconds = range(10, DURATION, 10)
    assert found["time_s"] == pytest.approx([each / 1000 for each in milliseconds], abs=1e-12)
    for index, name in enumerate(JOINTS):
        assert found[f"{name}_position_rad"].tolist() == [joint_position(each, index) for each in milliseconds]


def test_positions_are_interpolated_and_states_are_held(recording: Path):
    found = table(recording, ("world", "game"), rate=1000)
    at = {round(1000 * time): row for row, time in enumerate(found["time_s"])}
    assert found["robot_x_m"][at[1013]] == pytest.approx(1.013, abs=1e-9)
    assert found["robot_spread_y_m"][at[1013]] == pytest.approx(0.2)
    phases = found["game_phase"]
    assert [phases[at[each]] for each in (499, 500, 1499, 1500, 3500)] == ["", "set", "set", "playing", "playing"]
    assert math.isnan(found["game_remaining_s"][at[499]]) and found["game_remaining_s"][at[500]] == 99.0


def test_angles_go_the_short_way_round(recording: Path):
    found = table(recording, ("world",), rate=1000)
    wanted = np.array([yaw(round(1000 * time)) for time in found["time_s"]])
    known = np.isfinite(found["robot_yaw_rad"])
    assert wanted.min() < -3.0 and wanted.max() > 3.0  # it does jump
    difference = (found["robot_yaw_rad"] - wanted + math.pi) % (2.0 * math.pi) - math.pi
    assert known.sum() > 3000 and np.abs(difference[known]).max() < 1e-9


def test_nothing_is_made_up_in_a_gap_nor_before_and_behind_the_messages(recording: Path):
    found = table(recording, ("truth", "joints"), rate=100)
    time, x = found["time_s"], found["truth_robot_x_m"]
    inside = (time > GAP[0] / 1000 + 1e-6) & (time < GAP[1] / 1000 - 1e-6)
    assert np.isnan(x[inside]).all()
    assert np.isnan(x[time < 0.0499]).all()  # the first truth is at 0.05 s, joint states begin earlier
    known = ~inside & (time > 0.0501) & (time < 3.9499)
    assert x[known] == pytest.approx(time[known], abs=1e-9)


def test_a_kick_shows_in_a_table_of_a_lower_rate(recording: Path):
    found = table(recording, ("decisions", "joints"), rate=2)
    asked = found["kicks_asked_for"]
    assert asked[found["time_s"] > KICK_AT / 1000].tolist() == [1.0] * 6
    assert np.nansum(asked[found["time_s"] < 0.7]) == 0.0


def test_topics_that_the_recording_lacks_are_named(recording: Path):
    left_out = table(recording, ("features", "world"), rate=10).left_out
    assert len(left_out) == 1 and left_out[0].startswith("features: seen_ball to ")


@pytest.mark.parametrize("ending", [".csv", ".parquet", ".mat"])
def test_files_hold_the_table(recording: Path, tmp_path: Path, ending: str):
    path = tmp_path / f"table{ending}"
    result = run(recording, "--to", path, "--groups", "world,game", "--rate", "20")
    assert result.exit_code == 0, result.stderr
    wanted = table(recording, ("world", "game"), rate=20)
    names = [column.name for column in wanted.columns]
    if ending == ".csv":
        rows = list(csv.DictReader(path.open()))
        found = {name: [row[name] for row in rows] for name in names}
        numbers = {name: np.array([float(value or "nan") for value in found[name]]) for name in ("robot_x_m", "time_s")}
        phases = found["game_phase"]
        about = {row["column"]: row for row in csv.DictReader((tmp_path / "table.columns.csv").open())}
        assert about["robot_x_m"]["unit"] == "m" and about["game_phase"]["between messages"] == "last"
    elif ending == ".parquet":
        content = pq.read_table(path)
        numbers = {name: content[name].to_numpy() for name in ("robot_x_m", "time_s")}
        phases = content["game_phase"].to_pylist()
        assert content.schema.field("robot_x_m").metadata[b"unit"] == b"m"
        assert content.column_names == names
    else:
        matlab = loadmat(path)
        numbers = {name: matlab[name][:, 0] for name in ("robot_x_m", "time_s")}
        phases = [str(cell[0]) if cell.size else "" for cell in matlab["game_phase"][:, 0]]
        assert {str(row[0]) for row in matlab["columns"][:, 0]} == set(names)
    for name, values in numbers.items():
        assert values == pytest.approx(wanted[name], abs=1e-8, nan_ok=True)
    assert phases == wanted["game_phase"].tolist()


def test_all_names_are_legal_in_matlab_and_end_with_their_units():
    for source in SOURCES:
        for column in source.columns:
            assert is_matlab_name(column.name), column.name
            assert column.name.endswith(UNITS[column.unit]), column.name


def test_of_two_robots_one_is_chosen(tmp_path: Path):
    path = write(tmp_path / "two", ("keeper", "striker"), end=200)
    with Log(path) as log:
        assert set(robots_in(log)) == {"keeper", "striker"} and choose_robot(log, None) == "striker"
    result = run(path, "--to", tmp_path / "t.csv", "--robot", "keeper", "--groups", "world")
    assert result.exit_code == 0 and "robot keeper (with --robot: striker)" in result.stdout
    result = run(path, "--to", tmp_path / "u.csv", "--robot", "goalie")
    assert result.exit_code == 2 and "keeper, striker" in result.stderr


def test_after_time_began_anew_the_longest_part_counts(tmp_path: Path):
    bag = Bag(tmp_path / "anew")
    for begin, end, late in ((2000, 2300, 0), (10, 3000, 2400)):
        for milliseconds in range(begin, end, 10):
            for topic, message in messages(milliseconds):
                add(bag, topic, message, milliseconds + late)
    bag.close()
    with Log(tmp_path / "anew") as log:
        found = read(log, "", topics_of(sources_of(("joints",))))
    assert found.runs == 2
    assert (found.begin, found.end) == pytest.approx((0.01, 2.99))
    assert not found.log_time_is_stamp


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--to", "table.xls"), "expected .csv or .parquet or .mat"),
        (("--to", "t.csv", "--groups", "joint"), "Did you mean joints"),
        (("--to", "t.csv", "--groups", ""), "--groups is empty"),
        (("--to", "t.csv", "--groups", "features"), "has none of the topics"),
        (("--to", "t.csv", "--rate", "0"), "--rate is 0 Hz; expected more than 0"),
        (("--to", "t.csv", "--rate", "1e9"), "expected at most"),
        (("--to", "t.csv", "--rate", "5", "--times-of", "odometry"), "expected one of them"),
        (("--to", "t.csv", "--times-of", "joint_state"), "Did you mean joint_states"),
        (("--to", "no/such/folder/t.csv"), "There is no folder no/such/folder"),
        (("--to", "/proc/t.csv"), "/proc/t.csv cannot be written"),
    ],
)
def test_bad_choices_are_told(
    recording: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: tuple[str, ...], said: str
):
    monkeypatch.chdir(tmp_path)
    result = run(recording, *arguments)
    assert result.exit_code == 2 and said in result.stderr
    assert not list(tmp_path.iterdir())


def test_an_old_table_is_kept_without_force(recording: Path, tmp_path: Path):
    path = tmp_path / "t.csv"
    path.write_text("results of last year")
    result = run(recording, "--to", path)
    assert result.exit_code == 2 and "--force" in result.stderr
    assert path.read_text() == "results of last year"
    assert run(recording, "--to", path, "--groups", "game", "--force").exit_code == 0
    assert path.read_text().startswith("time_s,game_phase")


def test_a_recording_without_robot_is_told(tmp_path: Path):
    bag = Bag(tmp_path / "clock")
    bag.add_topic("/clock", topics.CLOCK.type_name, topics.CLOCK.quality)
    bag.close()
    result = run(tmp_path / "clock", "--to", tmp_path / "t.csv")
    assert result.exit_code == 2 and "holds no robot" in result.stderr


def test_a_table_that_does_not_fit_into_memory_is_refused_before_it_is_made(recording: Path):
    with Log(recording) as log:
        sources = sources_of(("joints",))
        found = read(log, choose_robot(log, None), topics_of(sources, None))
    times = np.broadcast_to(0.0, MOST_VALUES)  # takes no memory itself
    with pytest.raises(BadInputError, match="Choose a lower --rate"):
        make_table(found, sources, times)
