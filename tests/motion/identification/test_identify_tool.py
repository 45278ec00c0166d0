"""identify.py fit, validate, compare and dynamic: what they print, write and refuse."""

from __future__ import annotations

import re
from pathlib import Path

import identify as identify_tool
import numpy as np
import pytest
from synthetic import measure, postures
from synthetic_motion import swaying_log
from typer.testing import CliRunner, Result

from tulip_description.body_file import read_body
from tulip_description.robot import load_robot
from tulip_motion.identification.body_comparison import base_values, com_rows, rms
from tulip_motion.identification.motion_log import MotionLog
from tulip_sim.secret_body import secret_body

ROBOT = load_robot()
TRUTH = secret_body(ROBOT, np.random.default_rng(11))
FRICTION = np.linspace(0.2, 0.9, 14)  # [N m] Coulomb; half as much viscous, by 1 rad/s
WALK = Path(__file__).parents[2] / "data" / "recordings" / "walk"


@pytest.fixture(scope="module")
def measured() -> list[object]:
    held = postures(ROBOT, 40, np.random.default_rng(4))
    return [(None, each) for each in measure(TRUTH, held, np.random.default_rng(5))]


@pytest.fixture
def recording(tmp_path: Path, measured: list[object], monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a file in whose place the measurements are read: reading real ones is tested elsewhere."""
    path = tmp_path / "experiment.mcap"
    path.write_bytes(b"")
    monkeypatch.setattr(identify_tool, "measurements_of", lambda *arguments: measured)
    monkeypatch.setattr(identify_tool, "files_of", lambda path: [path])
    return path


@pytest.fixture(scope="module")
def swaying() -> MotionLog:
    return swaying_log(TRUTH, joint_amplitude=0.3, trunk_amplitude=0.02, friction=(FRICTION, 0.5 * FRICTION, 0.1))


def run(*arguments: object) -> Result:
    return CliRunner().invoke(identify_tool.app, [str(argument) for argument in arguments])


def test_fit_writes_a_body_that_has_the_true_com_and_says_how_sure_it_is(recording: Path, tmp_path: Path):
    body = tmp_path / "body.yaml"
    result = run("fit", recording, "--output", body)
    assert result.exit_code == 0, result.output
    assert "found [mm]" in result.output and "foretold CoP of 8 other postures" in result.output
    rows = com_rows(ROBOT, 200, np.random.default_rng(1))
    found = read_body(body).on(ROBOT)
    assert (rms(rows @ (base_values(found) - base_values(TRUTH))) < 1e-3).all()
    assert run("fit", recording, "--output", body).exit_code == 2
    assert run("validate", recording, body).exit_code == 0


def test_compare_tells_by_what_a_body_differs_from_the_robot_file(recording: Path, tmp_path: Path):
    body = tmp_path / "body.yaml"
    run("fit", recording, "--output", body)
    result = run("compare", body)
    assert result.exit_code == 0, result.output
    assert f"and {ROBOT.mass:.2f} kg" in result.output and "CoM differs by" in result.output
    assert "CoM differs by 0.00 mm forwards, 0.00 mm sideways" in run("compare", body, body).output


def test_a_body_whose_trunk_is_2_cm_off_fails_validation(recording: Path, tmp_path: Path, measured: list[object]):
    body = tmp_path / "body.yaml"
    run("fit", recording, "--output", body)
    text, forward = body.read_text(), read_body(body).base_values[0]
    assert text.count(f"value: {forward}") == 1
    body.write_text(text.replace(f"value: {forward}", f"value: {forward + 0.02}"))
    assert run("validate", recording, body).exit_code == 1


def test_dynamic_tells_mass_zmp_and_friction_and_writes_a_body(
    swaying: MotionLog, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path, body = tmp_path / "sways.mcap", tmp_path / "body.yaml"
    path.write_bytes(b"")
    monkeypatch.setattr(identify_tool, "motion_log_of", lambda path, robot: swaying)
    monkeypatch.setattr(identify_tool, "files_of", lambda path: [path])
    result = run("dynamic", path, "--output", body)
    assert result.exit_code == 0, result.output
    mass = float(re.search(r"mass +(\S+) kg \+-", result.output).group(1))
    assert mass == pytest.approx(TRUTH.mass, rel=0.005)
    after, before = map(float, re.search(r"off by (\S+) mm \(RMS\), before (\S+) mm", result.output).groups())
    assert after < 0.2 * before
    knee = float(re.search(r"right_knee[^\d]+1\.00[^\d]+(\S+) \+-", result.output).group(1))
    assert knee == pytest.approx(1.5 * FRICTION[9], rel=0.1)
    assert "left_knee         moved" in result.output  # it stands
    assert read_body(body).source.postures == 0
    rows, found = com_rows(ROBOT, 200, np.random.default_rng(1)), read_body(body).on(ROBOT)
    before_mm, after_mm = (rms(rows @ (base_values(each) - base_values(TRUTH))) for each in (ROBOT, found))
    assert (after_mm < 0.5 * before_mm).all()
    assert run("dynamic", path, "--output", body).exit_code == 2


def test_dynamic_tells_the_body_if_no_leg_swings_and_names_the_recording_that_it_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    standing = swaying_log(TRUTH, seconds=6.0, on_one_foot=False)
    monkeypatch.setattr(identify_tool, "motion_log_of", lambda path, robot: standing)
    result = run("dynamic", "squats.mcap")
    assert result.exit_code == 0, result.output
    assert "friction          not told: no leg joint moved enough while its leg swung" in result.output
    still = {name: np.repeat(getattr(standing, name)[:1], 1000, axis=0) for name in vars(standing) if name != "period"}
    monkeypatch.setattr(identify_tool, "motion_log_of", lambda path, robot: MotionLog(standing.period, **still))
    result = run("dynamic", "standing.mcap")
    assert result.exit_code == 2
    assert "Recording standing.mcap: the trunk's acceleration varies by 0.000 m/s^2 only" in result.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("fit", WALK), "has no topic /identification/progress"),
        (("fit", "nowhere.mcap"), "There is no recording"),
        (("dynamic", WALK), "has no messages of /joint_states, /imu, /foot_forces"),
        (("dynamic", "nowhere.mcap"), "There is no recording"),
        (("validate", WALK, "nowhere.yaml"), "cannot be read"),
        (("compare", WALK / "metadata.yaml"), "version"),
    ],
)
def test_bad_input_ends_with_2_and_a_reason(arguments: tuple[object, ...], words: str, tmp_path: Path):
    result = run(*arguments, *(("--output", tmp_path / "new.yaml") if arguments[0] in ("fit", "dynamic") else ()))
    assert result.exit_code == 2
    assert words in result.output.replace("\n", " ")
    assert not (tmp_path / "new.yaml").exists()
