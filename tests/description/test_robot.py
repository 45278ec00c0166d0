"""The robot's parameter file, its URDF, postures and camera."""

from __future__ import annotations

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

import tulip_description
from tulip_description.camera_pose import camera_in_footprint
from tulip_description.model import floating_model, joint_indices, sole_model
from tulip_description.posture import standing_posture
from tulip_description.robot import JOINTS, LEG_JOINTS, VARIANTS, load_robot, realizable_inertia
from tulip_description.urdf import build_urdf

ROBOT = load_robot()


def test_playing_robot_weighs_23_kg_and_is_1_25_m_tall() -> None:
    assert pytest.approx(23.0, abs=1e-9) == ROBOT.mass
    model = floating_model(ROBOT)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    sole = data.oMf[model.getFrameId("l_sole")].translation[2]
    tops = [
        data.oMf[model.getFrameId(link.name)].translation[2] + box.centre[2] + box.size[2] / 2
        for link in ROBOT.links
        for box in link.boxes
    ]
    assert max(tops) - sole == pytest.approx(1.25, abs=0.005)


def test_table_variant_weighs_16_74_kg_and_keeps_unrealizable_inertias() -> None:
    table = load_robot("table")
    assert table.mass == pytest.approx(16.74, abs=1e-9)
    assert table.joint_names == LEG_JOINTS
    assert max(table.link("left_thigh").inertia) > sum(table.link("left_thigh").inertia) / 2


def test_joints_come_in_the_published_order() -> None:
    assert ROBOT.joint_names == JOINTS
    assert tuple(floating_model(ROBOT).names)[2:] == JOINTS


def test_every_link_of_the_playing_robot_has_a_realizable_inertia() -> None:
    for link in ROBOT.links:
        assert max(link.inertia) < sum(link.inertia) / 2, link.name


@given(st.tuples(*[st.floats(1e-5, 1.0)] * 3))
def test_realizable_inertia_satisfies_the_triangle_inequality_and_keeps_valid_ones(
    moments: tuple[float, float, float],
) -> None:
    result = realizable_inertia(moments)
    assert max(result) < sum(result) / 2
    if max(moments) <= (0.5 - 0.005) * sum(moments):
        assert result == moments
    else:  # nearest: no other valid point of a small grid round it is nearer
        distance = np.linalg.norm(np.subtract(result, moments))
        for step in itertools.product((-1e-3, 0.0, 1e-3), repeat=3):
            other = np.add(result, step)
            if other.min() > 0 and max(other) <= (0.5 - 0.0025) * sum(other):
                assert np.linalg.norm(other - moments) >= distance - 1e-12


@pytest.mark.parametrize("variant", VARIANTS)
def test_urdf_has_the_same_dynamics_as_the_model(variant: str) -> None:
    robot = load_robot(variant)
    ours = floating_model(robot)
    read = pin.buildModelFromXML(build_urdf(robot), pin.JointModelFreeFlyer())
    rng = np.random.default_rng(1)
    joints, rates = rng.uniform(-0.8, 0.8, (2, len(robot.joint_names)))
    base = np.array([0.1, 0.2, 0.9, 0.0, 0.0, np.sin(0.3), np.cos(0.3)])
    twist = rng.uniform(-1, 1, 6)

    def force(model: pin.Model) -> np.ndarray:
        order = joint_indices(model, robot)
        q, v = np.zeros(model.nq), np.zeros(model.nv)
        q[:7], v[:6] = base, twist
        q[order + 1], v[order] = joints, rates
        torque = pin.rnea(model, model.createData(), q, v, v)
        return np.concatenate([torque[:6], torque[order]])

    np.testing.assert_allclose(force(read), force(ours), atol=1e-9)


def test_urdf_of_a_robot_whose_numbers_are_those_of_numpy_is_the_same() -> None:
    """numpy writes its own numbers as np.float64(1.0), which simulators read as 0 without a word."""
    robot = load_robot()
    links = tuple(
        replace(link, mass=np.float64(link.mass), com=tuple(np.array(link.com)), inertia=tuple(np.array(link.inertia)))
        for link in robot.links
    )
    assert build_urdf(replace(robot, links=links)) == build_urdf(robot)


@pytest.mark.parametrize("variant", VARIANTS)
def test_urdf_carries_limits_and_frames(variant: str) -> None:
    robot = load_robot(variant)
    read = pin.buildModelFromXML(build_urdf(robot), pin.JointModelFreeFlyer())
    order = joint_indices(read, robot)
    np.testing.assert_allclose(read.upperPositionLimit[order + 1], robot.position_limits[1])
    np.testing.assert_allclose(read.effortLimit[order], robot.effort_limits)
    for name in ("base_link", "l_sole", "r_sole", "imu_link"):
        assert read.existFrame(name)
        assert floating_model(robot).existFrame(name)


def test_right_leg_mirrors_left_leg() -> None:
    model = floating_model(ROBOT)
    data = model.createData()
    left = np.array([0.2, 0.1, -0.5, 0.9, -0.4, -0.1])
    right = left * np.array([-1, -1, 1, 1, 1, -1])
    pin.framesForwardKinematics(model, data, np.concatenate([pin.neutral(model)[:7], left, right, [0, 0]]))
    soles = [data.oMf[model.getFrameId(name)].translation for name in ("l_sole", "r_sole")]
    np.testing.assert_allclose(soles[0] * [1, -1, 1], soles[1], atol=1e-12)


def test_knee_bends_and_hip_pitch_has_rep_103_signs() -> None:
    model = sole_model(ROBOT, "right")
    data = model.createData()
    q = np.zeros(model.nv)
    q[joint_indices(model, ROBOT)[LEG_JOINTS.index("left_hip_pitch")]] = 0.3
    pin.framesForwardKinematics(model, data, q)
    feet = [data.oMf[model.getFrameId(name)].translation[0] for name in ("l_sole", "r_sole")]
    assert feet[0] < feet[1] - 0.1  # positive hip pitch takes the leg back


@pytest.mark.parametrize("variant", VARIANTS)
def test_standing_posture_has_flat_soles_on_the_ground_and_com_over_them(variant: str) -> None:
    robot = load_robot(variant)
    posture = standing_posture(robot, hip_height=0.58, feet_distance=0.22, com_ahead=0.03)
    model = floating_model(robot)
    data = model.createData()
    q = np.concatenate([[posture.base_x, 0, posture.base_height, 0, 0, 0, 1], posture.joint_positions])
    pin.framesForwardKinematics(model, data, q)
    for name, y in (("l_sole", 0.11), ("r_sole", -0.11)):
        sole = data.oMf[model.getFrameId(name)]
        np.testing.assert_allclose(sole.translation, [0, y, 0], atol=1e-9)
        np.testing.assert_allclose(sole.rotation, np.eye(3), atol=1e-9)
    assert pin.centerOfMass(model, data, q)[0] == pytest.approx(0.03, abs=1e-8)
    assert data.oMf[model.getFrameId("left_thigh")].translation[2] == pytest.approx(0.58, abs=1e-9)


def test_standing_posture_refuses_an_unreachable_height() -> None:
    with pytest.raises(ValueError, match=r"hip_height is 0\.7"):
        standing_posture(ROBOT, hip_height=0.7)


def test_default_stand_matches_the_trial_mass_distribution() -> None:
    posture = standing_posture(ROBOT)
    model = floating_model(ROBOT)
    q = np.concatenate([[posture.base_x, 0, posture.base_height, 0, 0, 0, 1], posture.joint_positions])
    com = pin.centerOfMass(model, model.createData(), q)
    assert com[2] == pytest.approx(0.714, abs=0.003)
    assert com[0] == pytest.approx(0.040, abs=1e-6)


@given(st.floats(-2, 2), st.floats(-0.6, 1.2), st.floats(-0.3, 0.3), st.floats(-0.3, 0.3), st.floats(-3, 3))
def test_camera_pose_equals_pinocchio(pan: float, tilt: float, roll: float, pitch: float, yaw: float) -> None:
    model = floating_model(ROBOT)
    data = model.createData()
    rotation = pin.rpy.rpyToMatrix(roll, pitch, yaw)
    q = pin.neutral(model)
    q[:7] = pin.SE3ToXYZQUAT(pin.SE3(rotation, np.array([0, 0, 1.08])))
    q[-2:] = pan, tilt
    pin.framesForwardKinematics(model, data, q)
    yaw_of_base = np.arctan2(rotation[1, 0], rotation[0, 0])
    footprint = pin.SE3(pin.rpy.rpyToMatrix(0, 0, yaw_of_base), np.zeros(3))
    expected = footprint.inverse() * data.oMf[model.getFrameId("camera_optical_frame")]
    np.testing.assert_allclose(camera_in_footprint(ROBOT, 1.08, q[3:7], pan, tilt), expected.homogeneous, atol=1e-9)


def test_camera_looks_ahead_and_down() -> None:
    pose = camera_in_footprint(ROBOT, 1.08, (0, 0, 0, 1), 0.0, 0.5)
    assert pose[0, 2] > 0.8 and pose[2, 2] < -0.4  # the optical axis
    assert pose[1, 0] == pytest.approx(-1.0)  # x to the right


def test_unknown_variant_and_names_are_named_in_errors() -> None:
    with pytest.raises(ValueError, match=r"variant is 'kid'; expected one of playing, table"):
        load_robot("kid")
    with pytest.raises(ValueError, match="no joint is named 'elbow'"):
        ROBOT.joint("elbow")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 8.154", "mass: heavy", "mass is 'heavy'; expected a number"),
        ("axis: z", "axis: w", "axis is 'w'; expected x, y or z"),
        ("range: [-1.0, 1.0]", "range: [1.0, -1.0]", "expected lower < upper"),
        ("joint: knee", "joint: elbow", "expected the leg's joints in the order"),
        ("leg_velocity: 15.0", "", "leg_velocity is missing"),
        ("leg:", "leg: [", "is not YAML"),
    ],
)
def test_wrong_parameter_files_are_refused_with_the_place(tmp_path: Path, old: str, new: str, message: str) -> None:
    import tulip_description

    text = (Path(tulip_description.__path__[0]) / "robot.yaml").read_text(encoding="utf-8")
    assert old in text
    path = tmp_path / "robot.yaml"
    path.write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(ValueError, match=message) as error:
        load_robot(path=path)
    assert str(path) in str(error.value)


@pytest.mark.parametrize("number", [".nan", ".inf", "1" + "0" * 400])
def test_a_mass_that_is_no_finite_number_is_refused(number: str, tmp_path: Path):
    text = Path(str(tulip_description.__file__)).with_name("robot.yaml").read_text()
    assert "mass: 8.154" in text
    (tmp_path / "robot.yaml").write_text(text.replace("mass: 8.154", f"mass: {number}"))
    with pytest.raises(ValueError, match=r"mass|64 bits"):
        load_robot(path=tmp_path / "robot.yaml")
