"""The joint driver: eq. (13), saturation, time-out and refusals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.robot import HEAD_JOINTS, JOINTS, LEG_JOINTS, load_robot
from tulip_description.robot_io import JointCommand
from tulip_sim.driver import MILLISECOND, JointDriver
from tulip_sim.parameters import DriverParameters

ROBOT = load_robot()
KNEE = JOINTS.index("left_knee")
START = np.zeros(14)


def command(names: tuple[str, ...] = LEG_JOINTS, sequence: int = 1, **values: float) -> JointCommand:
    fields = {"position": 0.0, "velocity": 0.0, "effort": 0.0, "stiffness": 0.0, "damping": 0.0, **values}
    return JointCommand(sequence, 0, names, **{name: np.full(len(names), value) for name, value in fields.items()})


def driver() -> JointDriver:
    return JointDriver(ROBOT, DriverParameters(), START)


def test_torque_is_pd_plus_feedforward() -> None:
    under_test = driver()
    assert under_test.accept(command(position=0.2, velocity=0.5, effort=1.0, stiffness=20.0, damping=2.0), 0) == ""
    torque = under_test.torques(0, np.full(14, 0.1), np.full(14, 0.3))
    assert torque[KNEE] == pytest.approx(20.0 * 0.1 + 2.0 * 0.2 + 1.0)


@given(
    st.floats(-1e4, 1e4), st.floats(0, 1e5), st.floats(-50, 50), st.lists(st.floats(-50, 50), min_size=14, max_size=14)
)
def test_torque_never_exceeds_the_limits(effort: float, stiffness: float, velocity: float, speeds: list[float]) -> None:
    under_test = driver()
    under_test.accept(command(effort=effort, stiffness=stiffness, damping=1.0, velocity=velocity), 0)
    torque = under_test.torques(0, np.full(14, 0.5), np.array(speeds))
    assert (np.abs(torque) <= ROBOT.effort_limits).all()


def test_no_torque_drives_a_joint_beyond_its_top_speed_but_it_can_brake() -> None:
    under_test = driver()
    under_test.accept(command(effort=30.0), 0)
    at_top_speed = ROBOT.velocity_limits
    assert under_test.torques(0, START, at_top_speed)[KNEE] == 0.0
    assert under_test.torques(0, START, 0.9 * at_top_speed)[KNEE] == pytest.approx(30.0)
    assert under_test.torques(0, START, 0.99 * at_top_speed)[KNEE] == pytest.approx(0.05 * 65.0)
    assert under_test.torques(0, START, -at_top_speed)[KNEE] == 30.0


def test_desired_positions_are_kept_inside_the_joint_ranges() -> None:
    under_test = driver()
    under_test.accept(command(position=-2.0, stiffness=10.0), 0)
    lower = ROBOT.position_limits[0, KNEE]
    assert under_test.torques(0, START, START)[KNEE] == pytest.approx(10.0 * lower)


def test_start_posture_is_held_until_the_first_command() -> None:
    under_test = JointDriver(ROBOT, DriverParameters(), np.full(14, 0.1))
    torque = under_test.torques(60_000 * MILLISECOND, np.full(14, 0.08), np.zeros(14))
    assert torque[KNEE] == pytest.approx(0.02 * 400.0)


def test_old_command_means_damping_only_and_then_limp() -> None:
    under_test = driver()
    under_test.accept(command(effort=5.0, stiffness=100.0, position=0.5), 0)
    speed = np.full(14, 0.5)
    assert under_test.torques(39 * MILLISECOND, START, speed)[KNEE] == pytest.approx(55.0)
    assert under_test.torques(40 * MILLISECOND, START, speed)[KNEE] == pytest.approx(-0.5 * 4.0)
    assert under_test.torques(539 * MILLISECOND, START, speed)[KNEE] == pytest.approx(-0.5 * 4.0)
    np.testing.assert_array_equal(under_test.torques(540 * MILLISECOND, START, speed)[:12], 0.0)


def test_time_out_of_the_legs_leaves_the_head_alone() -> None:
    under_test = driver()
    under_test.accept(command(effort=5.0), 0)
    under_test.accept(command(HEAD_JOINTS, effort=1.0), 90 * MILLISECOND)
    torque = under_test.torques(120 * MILLISECOND, START, START)
    assert torque[KNEE] == 0.0
    assert torque[-1] == 1.0


def test_new_command_ends_the_time_out() -> None:
    under_test = driver()
    under_test.accept(command(effort=5.0), 0)
    under_test.torques(700 * MILLISECOND, START, START)
    assert under_test.accept(command(effort=5.0, sequence=2), 700 * MILLISECOND) == ""
    assert under_test.torques(701 * MILLISECOND, START, START)[KNEE] == 5.0


def test_stale_sequence_is_refused_until_the_time_out_of_a_dead_sender() -> None:
    under_test = driver()
    under_test.accept(command(sequence=500, effort=5.0), 0)
    assert "expected more than 500" in under_test.accept(command(sequence=500, effort=9.0), MILLISECOND)
    assert under_test.torques(MILLISECOND, START, START)[KNEE] == 5.0
    assert under_test.accept(command(sequence=1, effort=9.0), 200 * MILLISECOND) == ""


@pytest.mark.parametrize("name", ["position", "velocity", "effort", "stiffness", "damping"])
@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_values_that_are_not_finite_are_refused_and_the_last_command_stays(name: str, value: float) -> None:
    under_test = driver()
    under_test.accept(command(effort=5.0), 0)
    bad = command(sequence=2)
    values = np.zeros(12)
    values[3] = value
    reason = under_test.accept(replace(bad, **{name: values}), MILLISECOND)
    assert reason == f"{name} of left_knee is not finite"
    assert under_test.torques(MILLISECOND, START, START)[KNEE] == 5.0


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (command((*LEG_JOINTS, "tail")), "unknown tail"),
        (command(("left_knee", "left_knee")), "expected different names"),
        (command(()), "expected different names"),
        (replace(command(), position=np.zeros(11)), r"position has shape (11,); expected (12,), one value a joint"),
        (command(stiffness=-1.0), "stiffness of left_hip_yaw is -1.0; expected >= 0"),
    ],
)
def test_malformed_commands_are_refused_with_the_reason(bad: JointCommand, reason: str) -> None:
    assert reason in driver().accept(bad, 0)


def test_a_joint_has_one_sender() -> None:
    under_test = driver()
    under_test.accept(command(), 0)
    assert "expected one sender a joint" in under_test.accept(command(("left_knee",)), 0)


def test_table_variant_has_a_driver_of_twelve_joints() -> None:
    under_test = JointDriver(load_robot("table"), DriverParameters(), np.zeros(12))
    assert under_test.torques(0, np.zeros(12), np.zeros(12)).shape == (12,)


def test_joints_are_silent_once_their_last_command_outlived_its_time_to_live() -> None:
    under_test = driver()
    assert under_test.silent_joints(10**12) == ()  # nobody ever commanded them: they hold the start posture
    under_test.accept(command(LEG_JOINTS), 0)
    under_test.accept(command(HEAD_JOINTS), 50 * MILLISECOND)
    live, head = DriverParameters().time_to_live, DriverParameters().head_time_to_live
    assert under_test.silent_joints((live - 1) * MILLISECOND) == ()
    assert under_test.silent_joints(live * MILLISECOND) == LEG_JOINTS
    assert under_test.silent_joints((head + 49) * MILLISECOND) == LEG_JOINTS
    assert under_test.silent_joints((head + 50) * MILLISECOND) == LEG_JOINTS + HEAD_JOINTS
    under_test.accept(command(LEG_JOINTS, sequence=2), 200 * MILLISECOND)
    assert under_test.silent_joints(200 * MILLISECOND) == HEAD_JOINTS
