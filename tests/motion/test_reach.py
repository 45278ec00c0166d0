"""How far the legs reach, and how a command too fast for them is clipped."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tulip_description.model import floating_model
from tulip_description.robot import LEG_JOINTS, load_robot
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_motion.reach import STRAIGHTEST, fastest_stride, reach, step_time

P = MotionParameters()
ROBOT = load_robot()
REACH = reach(P, ROBOT)


def ankle_and_com(hip_pitch: float, knee: float) -> tuple[float, float]:
    """How far the ankle is ahead of its hip [m], and how high the CoM of straight legs above the lower sole's plane."""
    model = floating_model(ROBOT)
    data = model.createData()
    q = pin.neutral(model)
    q[7 + LEG_JOINTS.index("left_hip_pitch")], q[7 + LEG_JOINTS.index("left_knee")] = hip_pitch, knee
    pin.forwardKinematics(model, data, q)
    hip, ankle = (data.oMi[model.getJointId(f"left_{name}")].translation for name in ("hip_pitch", "ankle_pitch"))
    return float(ankle[0] - hip[0]), float(hip[2] - ankle[2])


def test_a_leg_of_the_robot_puts_its_ankle_as_far_as_the_reach_says_before_its_share() -> None:
    full = reach(replace(P, reach_share=1.0), ROBOT)
    way, height = 0.5 * full.stride, 0.0
    length = STRAIGHTEST * math.hypot(*ankle_and_com(0.0, 0.0))
    height = math.sqrt(length**2 - way**2)
    angle = math.asin(way / length)
    ahead, below = ankle_and_com(-angle, 0.0)  # straight: a little longer than what the gait may use
    assert ahead == pytest.approx(way / STRAIGHTEST, rel=1e-6)
    assert below == pytest.approx(height / STRAIGHTEST, rel=1e-6)
    # And the hip is then where the CoM's height wants it: CoM to hip and ankle to sole are those of standing straight.
    model = floating_model(ROBOT)
    data = model.createData()
    com = pin.centerOfMass(model, data, pin.neutral(model))
    pin.updateFramePlacements(model, data)
    hip = data.oMi[model.getJointId("left_hip_pitch")].translation[2]
    ankle = data.oMi[model.getJointId("left_ankle_pitch")].translation[2]
    sole = data.oMf[model.getFrameId("l_sole")].translation[2]
    assert height + (ankle - sole) + (com[2] - hip) == pytest.approx(P.com_height, abs=1e-9)


def test_reach_grows_with_the_share_and_shrinks_with_the_height() -> None:
    assert reach(replace(P, reach_share=0.5), ROBOT).stride == pytest.approx(REACH.stride * 0.5 / P.reach_share)
    strides = [reach(replace(P, com_height=height), ROBOT).stride for height in (0.66, 0.70, 0.74, 0.76)]
    assert strides == sorted(strides, reverse=True)


def test_a_com_height_is_refused_exactly_where_the_legs_are_straight() -> None:
    with pytest.raises(ValueError, match="where the legs are straight") as error:
        reach(replace(P, com_height=0.9), ROBOT)
    highest = float(str(error.value).split("less than ")[1].split(" m")[0])
    assert reach(replace(P, com_height=highest - 0.001), ROBOT).stride < 0.1
    with pytest.raises(ValueError, match=f"less than {highest:.3f} m"):
        Motion(replace(P, com_height=highest + 0.001), ROBOT)


def test_steps_at_the_greatest_speeds_are_no_longer_than_the_reach() -> None:
    for speed in (REACH.forward, REACH.backward):
        assert speed * step_time(P, speed) <= REACH.stride + 1e-12
    assert P.stance_width + 2.0 * REACH.sideways * P.step_time <= REACH.farthest + 1e-12
    assert 2.0 * REACH.turning * P.step_time <= REACH.turn + 1e-12
    assert REACH.nearest < P.stance_width < REACH.farthest


@given(st.floats(0.05, 1.0), st.floats(0.0, 0.6), st.floats(0.2, 0.8))
def test_a_stride_limits_the_speed_to_the_one_whose_steps_are_that_long(
    stride: float, growth: float, duration: float
) -> None:
    parameters = replace(P, step_time=duration, step_time_growth=growth)
    speed = fastest_stride(1e9, stride, parameters)
    assert speed * step_time(parameters, speed) == pytest.approx(stride, rel=1e-6)
    assert fastest_stride(0.5 * speed, stride, parameters) == 0.5 * speed


speeds = st.tuples(st.floats(-3.0, 3.0), st.floats(-2.0, 2.0), st.floats(-6.0, 6.0))


def size(velocity: tuple[float, float, float]) -> float:
    forward, left, turn = velocity
    most = REACH.forward if forward >= 0.0 else REACH.backward
    return math.hypot(forward / most, left / REACH.sideways, turn / REACH.turning)


@given(speeds)
def test_a_command_is_clipped_onto_the_ellipsoid_in_its_own_direction_and_told(
    wanted: tuple[float, float, float],
) -> None:
    possible, note = REACH.limited(wanted)
    assert size(possible) <= 1.0 + 1e-12
    assert np.linalg.norm(np.cross(possible, wanted)) <= 1e-12 * np.dot(wanted, wanted) + 1e-300
    assert np.dot(possible, wanted) >= 0.0
    if size(wanted) <= 1.0:
        assert (possible, note) == (wanted, "")
    else:
        assert size(possible) == pytest.approx(1.0)
        assert note.startswith("walk command clipped: ") and "limits are" in note


@given(speeds)
def test_clipping_twice_is_clipping_once_and_left_is_as_right(wanted: tuple[float, float, float]) -> None:
    possible, _ = REACH.limited(wanted)
    assert REACH.limited(possible)[0] == pytest.approx(possible, rel=1e-12)
    forward, left, turn = wanted
    mirrored, _ = REACH.limited((forward, -left, -turn))
    assert mirrored == (possible[0], -possible[1], -possible[2])
