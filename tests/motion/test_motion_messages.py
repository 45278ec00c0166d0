"""Messages of the body and of motion control: what goes in comes out, through serialization."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

import numpy as np
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from scipy.spatial.transform import Rotation

from tulip_description import frames
from tulip_description.planar import Pose2D
from tulip_description.quaternion import pose_on_ground
from tulip_description.robot import JOINTS, LEG_JOINTS, load_robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_description.short_numbers import fixed_point
from tulip_motion.footsteps import Footstep
from tulip_motion.interface import (
    HeadCommand,
    HeadMode,
    MotionMode,
    MotionState,
    Odometry,
    Side,
    Support,
    WalkCommand,
    WalkMode,
)
from tulip_motion.messages import (
    COARSE,
    body_transforms,
    footsteps_to_message,
    head_command_from_message,
    head_command_to_message,
    joint_command_from_message,
    joint_command_to_message,
    motion_state_from_message,
    motion_state_to_message,
    odometry_from_message,
    odometry_to_message,
    sensors_from_messages,
    sensors_to_messages,
    walk_command_from_message,
    walk_command_to_message,
)

STAMP = 12_345_678_901
CELLS = np.array([foot.cells for foot in load_robot().feet])
Message = TypeVar("Message")


@pytest.fixture
def rng() -> np.random.Generator:
    return np.random.default_rng(5)


def _sent(message: Message) -> Message:
    sent: Message = deserialize_message(serialize_message(message), type(message))
    return sent


def _assert_equal(value: Any, expected: Any) -> None:
    assert type(value) is type(expected)
    for field in dataclasses.fields(expected):
        np.testing.assert_array_equal(getattr(value, field.name), getattr(expected, field.name), err_msg=field.name)


def _short(values: np.ndarray) -> np.ndarray:
    """Return values that a message tells exactly."""
    return fixed_point(values, COARSE)


def _quaternion(rng: np.random.Generator) -> np.ndarray:
    return Rotation.random(random_state=int(rng.integers(1000))).as_quat()


def _sensors(rng: np.random.Generator) -> Sensors:
    return Sensors(
        STAMP,
        rng.normal(size=14),
        rng.normal(size=14),
        rng.normal(size=14),
        _quaternion(rng),
        rng.normal(size=3),
        rng.normal(size=3),
        rng.uniform(5.0, 60.0, (2, 4)),
    )


def _odometry(rng: np.random.Generator) -> Odometry:
    return Odometry(STAMP, rng.normal(size=3), _quaternion(rng), rng.normal(size=3), rng.normal(size=3), 0.0)


def test_sensors_survive(rng: np.random.Generator) -> None:
    sensors = _sensors(rng)
    _assert_equal(sensors_from_messages(*(_sent(each) for each in sensors_to_messages(sensors, CELLS))), sensors)


def test_sensor_messages_have_one_stamp_and_the_names_and_frame_of_the_body(rng: np.random.Generator) -> None:
    joints, imu, forces = sensors_to_messages(_sensors(rng), CELLS)
    assert [each.header.stamp.sec for each in (joints, imu, forces)] == [12] * 3
    assert [each.header.stamp.nanosec for each in (joints, imu, forces)] == [345_678_901] * 3
    assert joints.name == list(JOINTS)
    assert imu.header.frame_id == frames.IMU


def test_centres_of_pressure_are_the_cells_weighted_by_their_forces(rng: np.random.Generator) -> None:
    cells = np.array([[20.0, 20.0, 20.0, 20.0], [0.0, 0.0, 0.0, 50.0]])
    _, _, forces = sensors_to_messages(dataclasses.replace(_sensors(rng), foot_cells=cells), CELLS)
    np.testing.assert_allclose(forces.left_cop, CELLS[0].mean(axis=0), atol=2.0**-17)
    np.testing.assert_allclose(forces.right_cop, CELLS[1, 3], atol=2.0**-17)


def test_a_foot_in_the_air_has_no_centre_of_pressure(rng: np.random.Generator) -> None:
    cells = np.array([[0.0, 0.2, 0.1, 0.0], [30.0, 30.0, 30.0, 30.0]])
    _, _, forces = sensors_to_messages(dataclasses.replace(_sensors(rng), foot_cells=cells), CELLS)
    assert np.isnan(forces.left_cop).all()
    assert np.isfinite(forces.right_cop).all()


def test_joints_in_another_order_are_refused(rng: np.random.Generator) -> None:
    joints, imu, forces = sensors_to_messages(_sensors(rng), CELLS)
    joints.name = list(reversed(JOINTS))
    with pytest.raises(ValueError, match="joint_states names head_tilt"):
        sensors_from_messages(joints, imu, forces)


@pytest.mark.parametrize("names", [LEG_JOINTS, ("head_pan", "head_tilt"), ()])
def test_joint_commands_survive(rng: np.random.Generator, names: tuple[str, ...]) -> None:
    command = JointCommand(2**32 - 1, STAMP, names, *(_short(rng.uniform(0.0, 9.0, len(names))) for _ in range(5)))
    _assert_equal(joint_command_from_message(_sent(joint_command_to_message(command))), command)


def test_joint_commands_are_told_in_steps_that_no_joint_notices(rng: np.random.Generator) -> None:
    command = JointCommand(1, STAMP, LEG_JOINTS, *(rng.uniform(-9.0, 9.0, 12) for _ in range(5)))
    told = joint_command_from_message(joint_command_to_message(command))
    assert np.abs(told.position - command.position).max() <= 2.0**-17
    assert np.abs(told.velocity - command.velocity).max() <= 2.0**-11
    assert np.abs(told.effort - command.effort).max() <= 2.0**-11


@pytest.mark.parametrize("mode", WalkMode)
def test_walk_commands_survive(mode: WalkMode) -> None:
    command = WalkCommand(STAMP, mode, (0.4, -0.1, 0.25))
    assert walk_command_from_message(_sent(walk_command_to_message(command))) == command


@pytest.mark.parametrize("glance", [None, (3.0, -1.0, 0.5)])
@pytest.mark.parametrize("mode", HeadMode)
def test_head_commands_survive(mode: HeadMode, glance: tuple[float, float, float] | None) -> None:
    command = HeadCommand(STAMP, mode, (1.0, 0.2, 0.1), glance)
    assert head_command_from_message(_sent(head_command_to_message(command))) == command


def test_odometry_survives_without_the_distance(rng: np.random.Generator) -> None:
    odometry = _odometry(rng)
    message = _sent(odometry_to_message(dataclasses.replace(odometry, distance=7.0)))
    assert (message.header.frame_id, message.child_frame_id) == (frames.ODOM, frames.BASE_LINK)
    _assert_equal(odometry_from_message(message), odometry)


def test_motion_state_survives_with_its_distance(rng: np.random.Generator) -> None:
    sizes = {"com": 3, "dcm": 2, "zmp": 2, "com_velocity": 3, "joint_positions": 12, "joint_velocities": 12}
    arrays = {name: _short(rng.normal(size=size)) for name, size in sizes.items()}
    arrays |= {f"{name}_desired": _short(rng.normal(size=size)) for name, size in sizes.items()}
    arrays |= {
        name: _short(rng.normal(size=12)) for name in ("torque_feedback", "torque_feedforward", "torque_learned")
    }
    arrays["zmp"] = np.full(2, np.nan)  # without contact
    state = MotionState(
        stamp=STAMP,
        mode=MotionMode.KICK,
        support=Support.LEFT,
        phase=0.25,
        step_count=17,
        soles=_short(rng.normal(size=(2, 4, 4))),
        reason="leans by 0.9 rad",
        **arrays,
    )
    message = _sent(motion_state_to_message(state, 3.5))
    assert message.distance == 3.5
    _assert_equal(motion_state_from_message(message), state)


def test_footsteps_are_told_in_their_order_with_their_headings() -> None:
    steps = [Footstep(Side.LEFT, Pose2D(1.0, -2.0, 0.5)), Footstep(Side.RIGHT, Pose2D(1.2, -2.2, -3.0))]
    message = _sent(footsteps_to_message(steps, STAMP))
    assert message.header.frame_id == frames.ODOM
    for step, pose in zip(steps, message.poses, strict=True):
        turn = pose.orientation
        told = pose_on_ground((pose.position.x, pose.position.y), (turn.x, turn.y, turn.z, turn.w))
        assert told.as_array() == pytest.approx(step.pose.as_array(), abs=1e-12)
    assert not footsteps_to_message((), STAMP).poses


def test_unknown_modes_are_refused() -> None:
    walk = walk_command_to_message(WalkCommand(STAMP, WalkMode.WALK))
    head = head_command_to_message(HeadCommand(STAMP, HeadMode.HOLD))
    walk.mode = head.mode = 99
    with pytest.raises(ValueError, match="99"):
        walk_command_from_message(walk)
    with pytest.raises(ValueError, match="99"):
        head_command_from_message(head)


@pytest.mark.parametrize("seed", range(20))
def test_body_transforms_compose_to_the_odometry(seed: int) -> None:
    odometry = _odometry(np.random.default_rng(seed))
    to_footprint, to_base = _sent(body_transforms(odometry)).transforms
    assert (to_footprint.header.frame_id, to_footprint.child_frame_id) == (frames.ODOM, frames.BASE_FOOTPRINT)
    assert (to_base.header.frame_id, to_base.child_frame_id) == (frames.BASE_FOOTPRINT, frames.BASE_LINK)
    footprint, base = _matrix(to_footprint), _matrix(to_base)
    expected = np.eye(4)
    expected[:3, :3] = Rotation.from_quat(odometry.orientation).as_matrix()
    expected[:3, 3] = odometry.position
    np.testing.assert_allclose(footprint @ base, expected, atol=1e-12)  # only rounding remains
    np.testing.assert_allclose(footprint[2], [0.0, 0.0, 1.0, 0.0], atol=1e-12)  # level, on the ground
    assert base[1, 0] == pytest.approx(0.0, abs=1e-12)  # no yaw is left:
    assert base[0, 0] >= 0.0  # x of base_link lies above x of base_footprint
    np.testing.assert_allclose(base[:2, 3], 0.0, atol=1e-12)


def _matrix(message: Any) -> np.ndarray:
    to, turn = message.transform.translation, message.transform.rotation
    matrix = np.eye(4)
    matrix[:3, :3] = Rotation.from_quat([turn.x, turn.y, turn.z, turn.w]).as_matrix()
    matrix[:3, 3] = to.x, to.y, to.z
    return matrix
