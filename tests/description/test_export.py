"""Robot, field and ball as URDF, SDF and MJCF: the numbers after loading are those of the robot file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.export.camera_view import CameraView
from tulip_description.export.mjcf import MjcfWorld, build_mjcf
from tulip_description.export.mjcf_robot import Placement
from tulip_description.export.parts import ExportError
from tulip_description.export.write import FORMATS, Export, write
from tulip_description.field import load_field
from tulip_description.field_solids import goal_frame, net_walls, painted_strips
from tulip_description.materials import GRAVITY, Materials
from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import CELL_NAMES, SIDES, load_robot
from tulip_sim.export_check.check import check
from tulip_sim.export_check.figures import MissingPartError, compare
from tulip_sim.export_check.from_sdf import SdfError, plain_sdf_figures, sdf_figures
from tulip_sim.export_check.wanted import merged, robot_figures

ROBOT, FIELD = load_robot(), load_field()
MATERIALS = Materials(
    friction=0.8,
    ball_mass=0.43,
    ball_rolling_deceleration=0.35,
    ball_stiffness=1.5e4,
    ball_damping=23.0,
    net_stiffness=2e3,
    net_damping=100.0,
    joint_friction=0.005,
)
CAMERA = CameraView(640, 480, 400.0, 15.0)
EXPORT = Export(ROBOT, FIELD, MATERIALS, CAMERA)
NO_MUJOCO = "MuJoCo is not installed (extra mujoco)"
NO_DRAKE = "Drake, which holds libsdformat, is not installed (extra sdf)"


@pytest.mark.parametrize("form", FORMATS)
def test_all_masses_coms_inertias_and_joints_are_the_same_after_loading(tmp_path: Path, form: str) -> None:
    if form == "mjcf":
        pytest.importorskip("mujoco", reason=NO_MUJOCO)
    rows = check(EXPORT, write(EXPORT, tmp_path / "new", [form]))
    assert [row.name for row in rows][:3] == [f"{form} robot", f"{form} field", f"{form} ball"]
    for row in rows:
        assert row.differences is not None and row.fits, row
    told = {difference.quantity: difference.count for difference in rows[0].differences or ()}
    assert told["mass [kg]"] == (15 if form == "urdf" else 18)  # Pinocchio merges what is on fixed joints
    assert told["effort [N m]"] == told["velocity [rad/s]"] == told["lower [rad]"] == 14


def test_a_mass_that_is_off_by_a_gram_is_noticed(tmp_path: Path) -> None:
    files = write(EXPORT, tmp_path, ["urdf"])
    robot = files["urdf", "robot"]
    text = robot.read_text()
    assert 'mass value="1.023"' in text
    robot.write_text(text.replace('mass value="1.023"', 'mass value="1.024"', 1))
    row = check(EXPORT, files)[0]
    assert not row.fits
    worst = max(row.differences or (), key=lambda each: each.greatest if each.quantity == "mass [kg]" else -1.0)
    assert worst.greatest == pytest.approx(0.001) and worst.where == "left_shank"


def test_merging_fixed_links_gives_pinocchios_bodies() -> None:
    ours = merged(ROBOT, robot_figures(ROBOT, MATERIALS)).bodies
    model = floating_model(ROBOT)
    trunk = model.inertias[1]
    assert ours["base_link"].mass == pytest.approx(trunk.mass)
    np.testing.assert_allclose(ours["base_link"].com, trunk.lever, atol=1e-12)
    np.testing.assert_allclose(ours["base_link"].inertia, trunk.inertia, atol=1e-12)


def test_a_missing_body_is_named() -> None:
    wanted = robot_figures(ROBOT, MATERIALS)
    found = replace(wanted, bodies={name: body for name, body in wanted.bodies.items() if name != "neck"})
    with pytest.raises(MissingPartError, match=r"expected base_link.*neck"):
        compare(found, wanted)


def test_libsdformat_refuses_an_element_that_the_specification_does_not_know(tmp_path: Path) -> None:
    pytest.importorskip("pydrake", reason=NO_DRAKE)
    path = write(EXPORT, tmp_path, ["sdf"])["sdf", "robot"]
    assert sdf_figures(path).joints
    path.write_text(path.read_text().replace("effort>", "efort>"))
    with pytest.raises(SdfError, match="efort"):
        sdf_figures(path)


def test_own_reading_of_sdf_and_libsdformats_are_the_same(tmp_path: Path) -> None:
    pytest.importorskip("pydrake", reason=NO_DRAKE)
    path = write(EXPORT, tmp_path, ["sdf"])["sdf", "world"]
    assert all(difference.fits for difference in compare(sdf_figures(path), plain_sdf_figures(path)))


def test_mujoco_has_the_mass_matrix_and_the_forces_of_pinocchio() -> None:
    mujoco = pytest.importorskip("mujoco", reason=NO_MUJOCO)
    robot = mujoco.MjModel.from_xml_string(
        build_mjcf(MjcfWorld(FIELD, MATERIALS, [Placement(ROBOT)], ("robot",), CAMERA))
    )
    data = mujoco.MjData(robot)
    rng = np.random.default_rng(3)
    joints, v = rng.uniform(-0.6, 0.6, 14), rng.uniform(-1.0, 1.0, 20)
    data.qpos[:] = [0.1, 0.2, 2.0, 1.0, 0.0, 0.0, 0.0, *joints]  # attitude zero: both count twists in the same axes
    data.qvel[:] = v
    mujoco.mj_forward(robot, data)
    M = np.zeros((20, 20))
    mujoco.mj_fullM(robot, data, M)
    model = floating_model(ROBOT)
    q = np.concatenate([[0.1, 0.2, 2.0, 0.0, 0.0, 0.0, 1.0], joints])
    pinned = model.createData()
    ours = pin.crba(model, pinned, q)
    np.testing.assert_allclose(M, np.triu(ours) + np.triu(ours, 1).T, atol=1e-9)
    # Pinocchio's base velocity is counted in axes that turn along: its acceleration lacks w x v.
    acceleration = np.zeros(20)
    acceleration[:3] = -np.cross(v[3:6], v[:3])
    np.testing.assert_allclose(data.qfrc_bias, pin.rnea(model, pinned, q, v, acceleration), atol=1e-9)


def test_in_mujoco_the_standing_robot_presses_its_weight_on_the_cells_and_feels_gravity() -> None:
    mujoco = pytest.importorskip("mujoco", reason=NO_MUJOCO)
    stand = Placement(ROBOT, stand=standing_posture(ROBOT))
    model = mujoco.MjModel.from_xml_string(build_mjcf(MjcfWorld(FIELD, MATERIALS, [stand], camera=CAMERA)))
    data = mujoco.MjData(model)
    mujoco.mj_resetDataKeyframe(model, data, model.key("stand").id)
    data.joint("ball").qpos[0] = 1.0
    hold = data.qpos.copy()
    joints = [model.joint(name) for name in ROBOT.joint_names]
    gains = np.array([150, 400, 400, 400, 200, 200] * 2 + [20, 20]), np.array([3, 8, 8, 8, 2, 0.4] * 2 + [0.3, 0.3])
    for _ in range(1000):
        for index, joint in enumerate(joints):
            q, v = data.qpos[joint.qposadr[0]], data.qvel[joint.dofadr[0]]
            data.ctrl[index] = gains[0][index] * (hold[joint.qposadr[0]] - q) - gains[1][index] * v
        mujoco.mj_step(model, data)
    cells = [data.sensor(f"{side}_{cell}").data[0] for side in SIDES for cell in CELL_NAMES]
    assert sum(cells) == pytest.approx(ROBOT.mass * GRAVITY, rel=0.02)  # it sways a little
    assert min(cells) > 1.0
    np.testing.assert_allclose(data.sensor("imu_link_linear_acceleration").data, [0, 0, GRAVITY], atol=0.3)
    assert data.body("ball").xpos[2] == pytest.approx(FIELD.ball_radius, abs=1e-3)


def test_mujocos_head_camera_is_where_vision_takes_it_to_be() -> None:
    mujoco = pytest.importorskip("mujoco", reason=NO_MUJOCO)
    world = MjcfWorld(FIELD, MATERIALS, [Placement(ROBOT, height=1.1)], ("robot",), CAMERA)
    model = mujoco.MjModel.from_xml_string(build_mjcf(world))
    data = mujoco.MjData(model)
    data.joint("head_pan").qpos, data.joint("head_tilt").qpos = 0.4, 0.3
    mujoco.mj_forward(model, data)
    optical = camera_in_footprint(ROBOT, 1.1, (0.0, 0.0, 0.0, 1.0), 0.4, 0.3)
    camera = data.camera("head_camera")
    np.testing.assert_allclose(camera.xpos, optical[:3, 3], atol=1e-9)
    # Optical frames look along z with y down, MuJoCo's along -z with y up.
    np.testing.assert_allclose(camera.xmat.reshape(3, 3), optical[:3, :3] * [1.0, -1.0, -1.0], atol=1e-9)
    assert np.radians(model.camera("head_camera").fovy[0]) == pytest.approx(2.0 * np.arctan(240.0 / 400.0))


def test_a_goal_is_open_for_a_ball_and_closed_behind() -> None:
    goal = FIELD.opponent_goal
    left, right, bar = goal_frame(goal)
    assert left.centre[1] - left.radius == pytest.approx(goal.width / 2)
    assert right.centre[1] + right.radius == pytest.approx(-goal.width / 2)
    assert bar.centre[2] - bar.radius == pytest.approx(goal.height)
    assert bar.centre[1] + bar.length / 2 == pytest.approx(left.centre[1] + left.radius)
    back = net_walls(goal)[0]
    assert back.centre[0] - back.size[0] / 2 == pytest.approx(goal.back)


def test_painted_strips_cover_lines_and_circle_and_nothing_else() -> None:
    strips = painted_strips(FIELD)
    covered = lambda x, y: any(  # noqa: E731
        abs(np.cos(s.yaw) * (x - s.x) + np.sin(s.yaw) * (y - s.y)) <= s.length / 2
        and abs(np.cos(s.yaw) * (y - s.y) - np.sin(s.yaw) * (x - s.x)) <= s.width / 2
        for s in strips
    )
    for line in FIELD.line_segments:
        assert covered(*line.start) and covered(*line.end)
    for angle in np.linspace(0.0, 6.0, 50):
        assert covered(0.75 * np.cos(angle), 0.75 * np.sin(angle))
        assert not covered(0.6 * np.cos(angle), 0.6 * np.sin(angle)) or abs(0.6 * np.cos(angle)) < 0.025
    assert all(covered(*mark) for mark in FIELD.penalty_marks)


@pytest.mark.parametrize("form", ["sdf", "mjcf"])
def test_a_robot_with_impossible_inertias_is_refused_before_anything_is_written(tmp_path: Path, form: str) -> None:
    table = replace(EXPORT, robot=load_robot("table"))
    with pytest.raises(ExportError, match=r"left_thigh.*belong to no body.*expected the playing variant"):
        write(table, tmp_path / "new", ["urdf", form])
    assert not (tmp_path / "new").exists()


def test_what_cannot_be_exported_is_said(tmp_path: Path) -> None:
    with pytest.raises(ExportError, match="formats are obj; expected some of urdf, sdf, mjcf"):
        write(EXPORT, tmp_path, ["obj"])
    (tmp_path / "mine.txt").write_text("keep me")
    with pytest.raises(ExportError, match="is no empty folder"):
        write(EXPORT, tmp_path, ["urdf"])
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]
    with pytest.raises(ExportError, match="parts are goal; expected some of robot, field, ball"):
        build_mjcf(MjcfWorld(FIELD, MATERIALS, parts=("goal",)))
