"""scripts/calibrate.py record and mount: the mount of the simulator's camera is found again."""

from __future__ import annotations

import math
import shutil
from pathlib import Path

import calibrate
import cv2
import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation
from typer.testing import CliRunner

from tulip_description.camera_mount import MountFileError, MountOffsets, load_mount, write_mount
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_sim.camera import CameraParameters, draw_mount
from tulip_sim.looking_round import look_round
from tulip_sim.scene import Body
from tulip_vision.calibration.field_lines import FieldLines
from tulip_vision.calibration.mount_fit import MountCalibration
from tulip_vision.calibration.recording import Shot, read_recording
from tulip_vision.lens import head_camera_lens

ROBOT = load_robot()
ANGLE, HEIGHT = math.radians(0.25), 0.006  # what the recovered mount may be off: 2 cm at 4 m


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(calibrate.app, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


def leaning(shot: Shot, roll: float) -> tuple[float, float, float, float]:
    """Return a shot's orientation with the trunk rolled further [rad]."""
    x, y, z, w = (Rotation.from_quat(shot.base_orientation) * Rotation.from_rotvec([roll, 0.0, 0.0])).as_quat().tolist()
    return x, y, z, w


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mount") / "look"
    code, text = run("record", folder, "--seed", 4, "--angle", 3.0, "--height", 0.02)
    assert code == 0, text
    return folder


@pytest.mark.sim
def test_the_mount_of_a_simulated_camera_is_found_from_pictures(recording: Path, tmp_path: Path) -> None:
    output = tmp_path / "mount.yaml"
    code, text = run("mount", recording, "--output", output)
    assert code == 0, text
    found, true = load_mount(output), load_mount(recording / "true_mount.yaml")
    assert max(abs(true.roll), abs(true.pitch), abs(true.yaw)) > math.radians(2.0)
    for name in ("roll", "pitch", "yaw"):
        assert getattr(found, name) == pytest.approx(getattr(true, name), abs=ANGLE), name
    assert found.height == pytest.approx(true.height, abs=HEIGHT)
    assert (found.pan, found.tilt) == (0.0, 0.0)
    assert cv2.imread(str(output.with_suffix(".png"))).shape == (480, 640 + 8 + 640, 3)


@pytest.mark.sim
def test_zero_offsets_of_the_joints_are_found_and_the_place_need_not_be_exact() -> None:
    place, true = Pose2D(-1.5, -0.4, 2.8), MountOffsets(pan=math.radians(-1.5), tilt=math.radians(2.0))
    got = list(look_round(7, place, head_camera_lens(), CameraParameters()))
    # The encoders read too little by what is to be added to them, the IMU 1.5 deg too much roll.
    lean = math.radians(1.5)
    moved = [
        type(shot)(shot.picture, shot.pan - true.pan, shot.tilt - true.tilt, shot.base_height, leaning(shot, lean))
        for _, shot in got
    ]
    put = Pose2D(place.x + 0.03, place.y - 0.02, place.yaw + 0.02)
    names = ("pan", "tilt", "height")
    calibration = MountCalibration(ROBOT, load_field(), head_camera_lens(), put, moved, MountOffsets(), names)
    fit = calibration.fit([picture for picture, _ in got], np.random.default_rng(1))
    assert fit.mount.tilt == pytest.approx(true.tilt, abs=ANGLE)
    assert abs(fit.robot.x - place.x) < 0.02 and abs(fit.robot.y - place.y) < 0.02
    # Pan and heading turn the camera alike; only their sum is seen, and the spread says so.
    assert fit.mount.pan + fit.robot.yaw == pytest.approx(true.pan + place.yaw, abs=ANGLE)
    assert fit.spread[0] > math.radians(1.0)
    assert abs(fit.mount.pan - true.pan) < 3.0 * fit.spread[0]
    assert fit.lean == pytest.approx((-lean, 0.0), abs=math.radians(0.6))  # the IMU's own bias is 0.2 deg
    assert fit.after < 2.5e-3 < fit.before


def test_offsets_move_the_camera_as_their_names_say() -> None:
    offsets = MountOffsets(0.02, -0.03, 0.05, 0.01, 0.1, -0.2)
    plain = camera_in_footprint(ROBOT, 1.08, (0, 0, 0, 1), 0.4, 0.3)
    shifted = camera_in_footprint(ROBOT, 1.08, (0, 0, 0, 1), 0.3, 0.5, offsets)
    assert ROBOT.camera is not None
    head = Rotation.from_euler("z", 0.4) * Rotation.from_euler("y", 0.3)
    turn = head * Rotation.from_euler("xyz", [0.02, -0.03, 0.05]) * head.inv()
    np.testing.assert_allclose(shifted[:3, :3], turn.as_matrix() @ plain[:3, :3], atol=1e-12)
    np.testing.assert_allclose(shifted[:3, 3] - plain[:3, 3], head.apply([0.0, 0.0, 0.01]), atol=1e-12)
    down = camera_in_footprint(ROBOT, 1.08, (0, 0, 0, 1), 0.0, 0.0, MountOffsets(pitch=0.1))
    assert down[2, 2] == pytest.approx(-math.sin(0.1))  # looks down


def test_the_simulators_mount_errs_by_its_seed_and_not_at_all_by_default() -> None:
    assert draw_mount(CameraParameters()) == MountOffsets()
    one, two = (CameraParameters(mount_angle=0.05, mount_height=0.01, mount_seed=seed) for seed in (1, 2))
    assert draw_mount(one) == draw_mount(one) != draw_mount(two)
    body = Body(ROBOT, "cyan", mount=draw_mount(one))
    base = np.eye(4)
    base[2, 3] = 1.08
    seen = body.camera_in_map(body.links_in_map(base, np.array([*[0.0] * 12, 0.4, 0.3])))
    expected = camera_in_footprint(ROBOT, 1.08, (0, 0, 0, 1), 0.4, 0.3, draw_mount(one))
    np.testing.assert_allclose(seen, expected, atol=1e-12)
    for bad in ({"mount_angle": -0.1}, {"mount_height": 1.0}):
        with pytest.raises(ValueError, match="expected 0 to"):
            CameraParameters(**bad)


def test_nearest_places_are_on_the_lines_and_none_is_nearer() -> None:
    field = load_field()
    lines = FieldLines(field)
    points = np.random.default_rng(2).uniform((-5.0, -3.5), (5.0, 3.5), (200, 2))
    dense = np.concatenate(lines.outlines())
    nearest = np.linalg.norm(points[:, None] - dense, axis=2).min(axis=1)
    distance = np.linalg.norm(lines.nearest(points) - points, axis=1)
    assert (distance <= nearest + 1e-12).all()
    assert (distance >= nearest - 0.05).all()  # outlines have a point every 7.5 cm


def test_mount_files_are_read_again_and_bad_ones_named(tmp_path: Path) -> None:
    offsets = MountOffsets(0.01, -0.02, 1.0 / 30.0, 0.004, 0.0, 0.1)
    write_mount(tmp_path / "m.yaml", offsets, ["why: because"])
    assert load_mount(tmp_path / "m.yaml") == offsets
    assert load_mount() == MountOffsets()  # the robot that plays
    for text, words in (("rol: 0.1", "expected only roll"), ("roll: [", "no|not YAML"), ("roll: 2.0", "roll is 2.0")):
        (tmp_path / "bad.yaml").write_text(text)
        with pytest.raises(MountFileError, match=words):
            load_mount(tmp_path / "bad.yaml")


@pytest.mark.sim
@pytest.mark.parametrize(
    ("change", "arguments", "words"),
    [
        ("missing", [], "recording.yaml cannot be read: No such file"),
        ("broken", [], "is not YAML"),
        ("no place", [], "lacks robot: x, y, yaw"),
        ("no tilt", [], "picture 0"),
        ("few", [], "has 3 pictures; expected at least 4"),
        ("picture", [], "look001.png cannot be read"),
        ("size", [], "is for pictures of 640 x 480 px; expected 320 x 240 px"),
        ("grey", [], "points on lines were found in"),
        ("elsewhere", [], "points fit the field's lines"),
        ("", ["--fit", "rol"], "no offset 'rol'. Did you mean roll?"),
        ("", ["--fit", "pitch,tilt"], "pitch and tilt do the same"),
        ("", ["--fit", ","], "names no offset"),
        ("", ["--start", "none.yaml"], "none.yaml cannot be read"),
    ],
)
def test_recordings_that_cannot_be_used_are_told_in_one_line(
    recording: Path, tmp_path: Path, change: str, arguments: list[str], words: str
) -> None:
    folder = tmp_path / "copy"
    shutil.copytree(recording, folder)
    path = folder / "recording.yaml"
    content = yaml.safe_load(path.read_text())
    if change == "no place":
        del content["robot"]
    elif change == "no tilt":
        del content["pictures"][0]["tilt"]
    elif change == "few":
        content["pictures"] = content["pictures"][:3]
    elif change == "elsewhere":
        content["robot"] = {"x": -3.0, "y": -1.5, "yaw": 0.9}
    elif change == "grey":
        for picture in folder.glob("*.png"):
            cv2.imwrite(str(picture), np.full((480, 640, 3), 100, np.uint8))
    elif change == "size":
        for picture in folder.glob("*.png"):
            cv2.imwrite(str(picture), np.full((240, 320, 3), 100, np.uint8))
    path.write_text(yaml.safe_dump(content))
    if change == "missing":
        path.unlink()
    elif change == "broken":
        path.write_text("a: [")
    elif change == "picture":
        (folder / "look001.png").unlink()
    code, text = run("mount", folder, "--output", tmp_path / "mount.yaml", *arguments)
    lines = [line for line in text.splitlines() if line.startswith("error: ")]
    assert code == 2, text
    assert len(lines) == 1 and words in lines[0], text
    assert not (tmp_path / "mount.yaml").exists()


@pytest.mark.sim
def test_a_recording_tells_what_the_robot_measured(recording: Path, tmp_path: Path) -> None:
    place, shots = read_recording(recording)
    assert place == Pose2D(1.2, 0.6, math.radians(10.0))
    assert len(shots) == len(list(recording.glob("*.png"))) == 18
    assert len({round(shot.tilt, 1) for shot in shots}) >= 3
    code, text = run("record", tmp_path / "off", "--x", 40.0)
    assert code == 2 and "is not on the carpet" in text and not (tmp_path / "off").exists()
