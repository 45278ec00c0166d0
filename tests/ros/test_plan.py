"""From what the user gives to what is started."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest
import yaml

from tulip_ros.errors import BadInputError
from tulip_ros.nodes import ROBOT
from tulip_ros.plan import make_plan, read_parameters


@pytest.fixture
def parameter_file(tmp_path: Path):
    def write(text: str) -> Path:
        path = tmp_path / "parameters.yaml"
        path.write_text(text)
        return path

    return write


def test_without_names_the_driver_and_the_whole_robot_start():
    plan = make_plan()
    assert [start.name for start in plan] == ["driver", *ROBOT]


def test_recorder_starts_first_and_names_count_once():
    assert [start.name for start in make_plan(["vision", "recorder", "vision"], driver=None)] == ["recorder", "vision"]


def test_only_a_simulated_robots_nodes_follow_the_clock():
    simulated = {start.name: start.parameters["use_sim_time"] for start in make_plan(["vision"], driver="sim")}
    assert simulated == {"driver": False, "vision": True}
    assert make_plan(["vision"], driver=None)[0].parameters["use_sim_time"] is False


def test_anybodys_body_is_run_by_the_driver_node_on_the_computers_time():
    driver, vision = make_plan(["vision"], driver="my_package.my_robot:MyRobot", values={"driver": {"clock": "host"}})
    assert driver.name == "driver" and driver.entry.module == "tulip_driver.body_node"
    assert driver.parameters["body"] == "my_package.my_robot:MyRobot"
    assert vision.parameters["use_sim_time"] is False


def test_both_forms_of_parameter_files_reach_the_node_and_later_layers_win(parameter_file, tmp_path: Path):
    text = """
    /**: {ros__parameters: {debug: false}}
    /striker/motion:
      ros__parameters:
        gait.step_time: 5e-1
        gait: {height: 0.03}
    vision: {threshold: 3}
    """
    plan = make_plan(["motion"], None, "striker", [parameter_file(text)], {"motion": {"gait": {"height": 0.05}}})
    file = tmp_path / "motion.yaml"
    command = plan[0].command(file)
    assert command[:3] == [sys.executable, "-m", "tulip_motion.motion_node"]
    assert command[-2:] == ["-r", "__ns:=/striker"]
    values = yaml.safe_load(file.read_text())["/**"]["ros__parameters"]
    assert values["gait"] == {"step_time": 0.5, "height": 0.05}
    assert values["debug"] is False
    assert "threshold" not in values


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"nodes": ["visoin"]}, "no node 'visoin'. Did you mean vision"),
        ({"driver": "gazebo"}, "no driver 'gazebo'"),
        ({"namespace": "3 robots"}, "Namespace is '3 robots'"),
        ({"parameter_files": [Path("/nowhere.yaml")]}, r"/nowhere\.yaml cannot be read"),
    ],
)
def test_unknown_names_are_refused(arguments: dict, message: str):
    with pytest.raises(BadInputError, match=message):
        make_plan(**arguments)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("vision: [1\n b", "no valid YAML"),
        ("- vision", "holds list"),
        ("visoin: {a: 1}", "Did you mean vision"),
        ("vision: 3", "expected `name: value`"),
    ],
)
def test_unusable_parameter_files_are_refused(parameter_file, text: str, message: str):
    with pytest.raises(BadInputError, match=message):
        read_parameters(parameter_file(text))


def test_empty_parameter_file_changes_nothing(parameter_file):
    assert read_parameters(parameter_file("# nothing\n")) == {}


def test_a_block_takes_the_place_of_a_value(parameter_file):
    [start] = make_plan(["motion"], None, "", [parameter_file("motion: {gait: dcm, gait.step_time: 0.4}")])
    assert start.parameters["gait"] == {"step_time": 0.4}


def test_names_of_more_parts_than_any_parameter_are_refused(parameter_file):
    with pytest.raises(BadInputError, match="too many parts"):
        make_plan(["motion"], None, "", [parameter_file(f"motion: {{{'.'.join('a' * 400)}: 1}}")])
