"""What the driver owns around any body: limits, time-out, limp, time, and readings that cannot be used."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bodies import ROBOT, Clock, NotedBody, command
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.robot import HEAD_JOINTS, JOINTS, LEG_JOINTS
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.contract import PERIOD
from tulip_driver.guard import MILLISECOND, GuardParameters
from tulip_driver.loop import BodyLoop

KNEE = JOINTS.index("left_knee")
LIFE = GuardParameters().time_to_live


def started(body: NotedBody | None = None) -> tuple[BodyLoop, NotedBody]:
    body = body or NotedBody()
    loop = BodyLoop(body, ROBOT, GuardParameters())
    loop.start()
    loop.tick()
    return loop, body


def told(body: NotedBody) -> JointCommand:
    newest = body.told[-1]
    assert newest is not None
    return newest


def test_body_is_told_nothing_until_somebody_commands() -> None:
    loop, body = started()
    loop.tick()
    assert body.told == [None, None]


def test_body_is_told_of_the_commanded_joints_alone() -> None:
    loop, body = started()
    assert loop.accept(command(loop.now, names=HEAD_JOINTS, stiffness=5.0)) == ""
    loop.tick()
    assert told(body).names == HEAD_JOINTS


def test_command_before_the_first_reading_is_refused() -> None:
    loop = BodyLoop(NotedBody(), ROBOT, GuardParameters())
    assert "no reading of the body has come yet" in loop.accept(command())


def test_wanted_position_starts_at_the_measured_one_and_moves_no_faster_than_the_joint_may() -> None:
    loop, body = started()
    measured = loop.sensors.joint_positions[KNEE]
    steps = []
    for sequence in range(1, 6):
        assert loop.accept(command(loop.now, sequence, position=2.4, stiffness=100.0)) == ""
        loop.tick()
        steps.append(told(body).position[KNEE] - measured)
        measured = told(body).position[KNEE]
    assert steps[1:] == pytest.approx([15.0 * PERIOD * 1e-9] * 4)
    assert 0.0 <= steps[0] <= 15.0 * PERIOD * 1e-9 + 1e-12


def test_with_a_smaller_rate_a_robot_creeps_to_its_posture() -> None:
    body = NotedBody()
    loop = BodyLoop(body, ROBOT, GuardParameters(), rate=0.02)
    loop.start()
    loop.tick()
    start = loop.sensors.joint_positions[KNEE]
    for sequence in range(1, 252):
        loop.accept(command(loop.now, sequence, position=2.4, stiffness=100.0))
        loop.tick()
    assert told(body).position[KNEE] - start == pytest.approx(0.02 * 15.0 * 1.0)  # a second at 0.3 rad/s


def test_after_limp_the_joint_starts_from_where_it_is_and_not_from_its_last_wanted_position() -> None:
    loop, body = started()
    loop.accept(command(loop.now, 1, position=loop.sensors.joint_positions[:12], stiffness=100.0))
    loop.tick()
    loop.limp("test")
    loop.tick()
    body._position[KNEE] += 0.5  # somebody bends the limp leg
    loop.tick()
    bent = loop.sensors.joint_positions[KNEE]
    loop.release()
    loop.tick()
    loop.accept(command(loop.now, 1, position=bent - 0.5, stiffness=100.0))
    loop.tick()
    assert told(body).position[KNEE] > bent - 0.07  # 15 rad/s in 4 ms


@given(
    position=st.floats(-10, 10),
    velocity=st.floats(-100, 100),
    effort=st.floats(-1e3, 1e3),
    stiffness=st.floats(0, 1e4),
    damping=st.floats(0, 1e2),
)
def test_no_command_leaves_the_ranges_speeds_and_torques(
    position: float, velocity: float, effort: float, stiffness: float, damping: float
) -> None:
    loop, body = started()
    wish = command(loop.now, position=position, velocity=velocity, effort=effort, stiffness=stiffness, damping=damping)
    assert loop.accept(wish) == ""
    before = loop.sensors
    loop.tick()
    lower, upper = ROBOT.position_limits[:, :12]
    out = told(body)
    assert (out.position >= lower - 1e-12).all() and (out.position <= upper + 1e-12).all()
    assert (np.abs(out.velocity) <= ROBOT.velocity_limits[:12]).all()
    torque = out.stiffness * (out.position - before.joint_positions[:12])
    torque += out.damping * (out.velocity - before.joint_velocities[:12]) + out.effort
    assert (np.abs(torque) <= ROBOT.effort_limits[:12] + 1e-6).all()


def test_silence_means_damping_at_the_time_to_live_and_limp_half_a_second_later() -> None:
    loop, body = started()
    begin = loop.now
    loop.accept(command(begin, stiffness=100.0, damping=3.0, effort=1.0))
    ages = []
    for _ in range((LIFE + 600) // 4):
        age = (loop.now - begin) // MILLISECOND
        loop.tick()
        ages.append((age, told(body).stiffness[3], told(body).effort[3], told(body).damping[3]))
    live = [each for each in ages if each[0] < LIFE]
    damped = [each for each in ages if LIFE <= each[0] < LIFE + 500]
    limp = [each for each in ages if each[0] >= LIFE + 500]
    assert {each[1] for each in live} == {100.0}
    assert {each[1:] for each in damped} == {(0.0, 0.0, 4.0)}
    assert {each[1:] for each in limp} == {(0.0, 0.0, 0.0)}
    assert loop.silent_joints == LEG_JOINTS


def test_a_body_whose_clock_rules_and_whose_readings_are_lost_is_damped_by_the_wall_clock(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wall = Clock(period=0)
    monkeypatch.setattr("tulip_driver.loop.monotonic_ns", wall)
    loop, body = started()
    loop.accept(command(loop.now, stiffness=100.0))
    lost = loop.sensors
    loop.tick()
    body.exchange = lambda told: body.told.append(told) or replace(lost, joint_efforts=np.full(14, np.nan))  # type: ignore
    for milliseconds, stiffness in ((900, 100.0), (1000 + LIFE - 10, 100.0), (1000 + LIFE + 10, 0.0)):
        wall.now = milliseconds * MILLISECOND
        loop.tick()
        assert told(body).stiffness[0] == stiffness, milliseconds


def test_limp_takes_all_torque_with_the_next_exchange_and_lasts_until_released() -> None:
    loop, body = started()
    loop.accept(command(loop.now, stiffness=100.0, effort=2.0))
    loop.tick()
    loop.limp("emergency stop")
    loop.tick()
    out = told(body)
    assert out.names == JOINTS
    assert not out.stiffness.any() and not out.damping.any() and not out.effort.any()
    assert "made limp (emergency stop); release it first" in loop.accept(command(loop.now, 2, stiffness=100.0))
    loop.release()
    assert loop.accept(command(loop.now, 1, stiffness=100.0)) == ""
    loop.tick()
    assert told(body).stiffness[0] == 100.0


def test_who_commands_a_limp_robot_is_known_to_live_and_to_have_answered() -> None:
    loop, body = started()
    loop.limp("emergency stop")
    loop.tick()
    assert not loop.answered
    assert loop.accept(command(loop.now, 1, stiffness=100.0))
    assert loop.answered and loop.silent_joints == ()
    for _ in range(LIFE // 4 + 1):
        loop.tick()
    assert loop.silent_joints == LEG_JOINTS
    assert not told(body).stiffness.any() and not told(body).damping.any()


def test_a_body_that_asks_for_an_emergency_stop_is_limp_with_the_next_exchange_and_stays_so_while_it_asks() -> None:
    loop, body = started()
    loop.accept(command(loop.now, 1, stiffness=100.0))
    body.emergency = "its stop button is pressed"
    loop.tick()
    loop.tick()
    assert told(body).names == JOINTS and not told(body).stiffness.any()
    assert "made limp (its stop button is pressed)" in loop.accept(command(loop.now, 2, stiffness=100.0))
    loop.release()
    loop.tick()
    assert loop.accept(command(loop.now, 3, stiffness=100.0))
    body.emergency = ""
    loop.tick()
    assert loop.accept(command(loop.now, 4, stiffness=100.0))  # that the button is out again is no release
    loop.release()
    assert loop.accept(command(loop.now, 5, stiffness=100.0)) == ""


def test_answers_to_old_sensors_or_to_some_of_another_time_are_refused() -> None:
    loop, _ = started()
    for _ in range(60):
        loop.tick()
    for stamp in (loop.now - (LIFE + 4) * MILLISECOND, loop.now + PERIOD):
        assert "it answers sensors of" in loop.accept(command(stamp))
    assert loop.accept(command(loop.now - LIFE * MILLISECOND)) == ""


def test_body_whose_clock_went_back_makes_the_driver_begin_anew() -> None:
    loop, body = started()
    for _ in range(100):
        loop.tick()
    loop.accept(command(loop.now, 50, stiffness=100.0))
    body.time.now = body._last = 0
    reading = loop.tick()
    assert reading is not None and reading.stamp == PERIOD
    loop.tick()
    assert body.told[-1] is None
    assert loop.accept(command(loop.now, 1, stiffness=100.0)) == ""


def test_same_reading_again_is_no_new_reading() -> None:
    loop, body = started()
    body.exchange = lambda _: loop.sensors  # type: ignore[method-assign]
    assert loop.tick() is None
    assert loop.faults == 0


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("joint_positions", np.zeros(12), "joint_positions of the body has shape (12,); expected (14,)"),
        ("imu_angular_velocity", np.array([0.0, np.nan, 0.0]), "imu_angular_velocity of the body holds nan"),
    ],
)
def test_readings_that_cannot_be_used_are_refused_by_name(field: str, value: np.ndarray, words: str) -> None:
    loop, body = started()
    good = body.exchange

    def bad(told: JointCommand | None) -> Sensors:
        return replace(good(told), **{field: value})

    body.exchange = bad  # type: ignore[method-assign]
    assert loop.tick() is None
    assert loop.faults == 1
    assert words in loop.fault


def test_stamps_are_in_the_computers_time_and_commands_reach_the_body_in_its_own() -> None:
    offset = 10**18
    body = NotedBody()
    loop = BodyLoop(body, ROBOT, GuardParameters(), lambda: body.time.now + offset)
    loop.start()
    reading = loop.tick()
    assert reading is not None and reading.stamp == offset + body.time.now
    assert loop.accept(command(reading.stamp, stiffness=1.0)) == ""
    asked = body.time.now
    loop.tick()
    assert told(body).stamp == asked
