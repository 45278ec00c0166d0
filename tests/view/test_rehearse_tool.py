"""rehearse.py, and what launch.py and identify.py ask of it: verdicts, exit codes, and what is refused."""

from __future__ import annotations

from pathlib import Path

import _rehearsal
import identify as identify_tool
import launch as launch_tool
import numpy as np
import pytest
import rehearse as rehearse_tool
import typer
from typer.testing import CliRunner, Result

from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_ros.errors import BadInputError
from tulip_ros.launch import Launcher
from tulip_ros.plan import make_plan
from tulip_sim.lockstep_recording import LockstepRecording, RecordedPictures
from tulip_sim.rehearsal.motions import Part
from tulip_sim.scenario import Scenario
from tulip_sim.world import World
from tulip_view.present_sensors import running

ROBOT = load_robot()


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a recording of a robot that stands for a second, and is pushed over then."""
    path = tmp_path_factory.mktemp("rehearsal") / "fall"
    world = World(Scenario(Pose2D(), (0.0, 2.0)), seed=1)
    out = LockstepRecording(path, RecordedPictures("none"))
    try:
        for tick in range(700):
            if tick == 250:
                world.push((300.0, 0.0, 0.0), 100)
            out.write("sensors", world.stamp, world.sensors())
            world.advance(4)
    finally:
        out.close()
        world.close()
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(rehearse_tool.app, [str(argument) for argument in arguments])


@pytest.mark.sim
def test_a_stand_from_a_recording_is_within_the_limits_and_drawn(recording: Path, tmp_path: Path) -> None:
    picture = tmp_path / "stand.png"
    result = run("stand", 0.4, "--from", f"{recording}@0.2", "--seeds", 1, "--picture", picture)
    assert result.exit_code == 0, result.output
    assert "within the limits" in result.output and "0 of 1" in result.output and picture.exists()


@pytest.mark.sim
def test_a_walk_that_falls_is_beyond_the_limits(tmp_path: Path) -> None:
    weak = tmp_path / "weak.yaml"
    weak.write_text("motion: {feedforward: none, stance_stiffness: [9.0, 9.0, 9.0, 9.0, 9.0, 9.0]}\n")
    result = run("walk", -0.1, 0, 0, "--seconds", 2, "--params", weak, "--seeds", 1)
    assert result.exit_code == 1, result.output
    assert "beyond the limits" in result.output and "falls (seed 1)" in result.output


@pytest.mark.sim
@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["hop"], "no motion 'hop'"),
        (["walk", 0.9, 0, 0], "the walk can do"),
        (["--from", "nowhere@3"], "no recording nowhere"),
        (["--from", "recordings"], "RECORDING@SECONDS"),
        (["--from", "{recording}@99"], "has no readings at 99 s; it lasts 2.8 s"),
        (["--from", "{recording}@2.4"], "set it upright"),
        (["--from", "{recording}@nan"], "expected 0 or more"),
        (["--from", "{recording}@0", "--namespace", "keeper"], "/keeper/joint_states"),
        (["--from", "{recording}@0", "--live"], "exclude each other"),
        (["--params", "missing.yaml"], "cannot be read"),
        (["--engine", "dart"], "pybullet or mujoco"),
        (["stand", "1", "--picture", "/nowhere/picture.png"], "cannot be written"),
    ],
)
def test_bad_input_is_refused_in_words(recording: Path, arguments: list[object], complaint: str) -> None:
    result = run(*(str(each).format(recording=recording) for each in arguments))
    assert result.exit_code == 2 and complaint in result.output and "Traceback" not in result.output


def test_parameters_come_from_the_plan_and_only_one_with_motion_control_is_rehearsed(tmp_path: Path) -> None:
    slow = tmp_path / "slow.yaml"
    slow.write_text("motion: {max_speed_forward: 0.2}\n")
    plan = make_plan((), "echo", parameter_files=[slow])
    assert _rehearsal.motion_parameters(plan).max_speed_forward == 0.2
    with pytest.raises(BadInputError, match="node motion"):
        _rehearsal.motion_parameters(make_plan(["vision"], "echo"))


@pytest.mark.parametrize(("anyway", "sent"), [(False, False), (True, True)])
def test_launch_starts_nothing_beyond_the_limits_unless_told(
    monkeypatch: pytest.MonkeyPatch, anyway: bool, sent: bool
) -> None:
    launched: list[object] = []
    monkeypatch.setattr(launch_tool, "keep_running", lambda launcher, namespace: launched.append(launcher))
    monkeypatch.setattr(_rehearsal, "passes", lambda *arguments: False)
    app = typer.Typer()
    app.command()(launch_tool.main)
    result = CliRunner().invoke(app, ["--driver", "echo", "--rehearse", *(["--anyway"] if anyway else [])])
    assert result.exit_code == (0 if sent else 1) and bool(launched) == sent
    assert "--anyway" in result.output


@pytest.mark.parametrize("rate", [0.0, 2.0, "slow", True, float("nan")])
def test_a_pace_that_no_driver_can_have_is_refused(rate: object) -> None:
    with pytest.raises(BadInputError, match=r"driver\.rate is .*; expected a number above 0"):
        _rehearsal.may_launch(make_plan((), "echo", values={"driver": {"rate": rate}}), anyway=True)


@pytest.mark.parametrize(("tool", "arguments"), [("launch", []), ("identify", ["run"])])
def test_anyway_alone_is_refused(tool: str, arguments: list[str]) -> None:
    app = identify_tool.app if tool == "identify" else typer.Typer()
    if tool == "launch":
        app.command()(launch_tool.main)
    result = CliRunner().invoke(app, [*arguments, "--anyway"])
    assert result.exit_code == 2 and "give --rehearse with it" in result.output


@pytest.mark.sim
def test_launch_rehearses_with_the_driver_s_own_pace(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_rehearsal, "everything", lambda parameters: (Part("walk 0.3 0 0", 5.0, (0.3, 0.0, 0.0)),))
    plan = make_plan((), "echo", values={"driver": {"rate": 0.03}})
    assert not _rehearsal.may_launch(plan, anyway=False)


def test_identify_does_not_begin_beyond_the_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_rehearsal, "passes", lambda *arguments: False)
    result = CliRunner().invoke(identify_tool.app, ["run", "--postures", "9", "--rehearse"])
    assert result.exit_code == 1 and "It is not sent" in result.output


@pytest.mark.ros
def test_a_running_driver_tells_how_its_robot_stands(ros_domain: int, tmp_path: Path) -> None:
    with Launcher(make_plan(["head"], "echo"), tmp_path):
        present = running(ROBOT, patience=30.0)
    np.testing.assert_allclose(present.joint_positions, standing_posture(ROBOT).joint_positions, atol=0.05)


@pytest.mark.ros
def test_a_robot_that_is_not_there_is_told(ros_domain: int) -> None:
    with pytest.raises(BadInputError, match="No robot was heard"):
        running(ROBOT, patience=0.5)
