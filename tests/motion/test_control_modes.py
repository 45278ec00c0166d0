"""Gaits and feedforward of motion control that are not the default, on the simulated body."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from tulip_description import frames
from tulip_description.model import floating_model
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.interface import MotionMode, Support, WalkCommand, WalkMode
from tulip_motion.joint_control import JointGains
from tulip_motion.motion import with_fixed_head
from tulip_motion.parameters import MotionParameters
from tulip_sim.bench.body import Body

START = Pose2D(-4.0, 2.2, 0.0)
FORWARD = WalkCommand(0, WalkMode.WALK, (0.2, 0.0, 0.0))


def body(seed: int = 0, **changes: Any) -> Body:
    walker = Body(seed, START, parameters=MotionParameters(**({"gait": "paper"} | changes)))
    walker.go(0.5)
    return walker


def test_stance_joints_stay_stable_at_the_period_of_the_joint_control() -> None:
    # An explicit step of joint damping diverges on a free link unless Kd dt / I < 2; the ankle roll's side is the
    # lightest, 0.00047 kg m^2.
    gains, dt, inertia = JointGains(MotionParameters()), 0.001, 0.00047
    for support in (Support.DOUBLE, Support.LEFT, Support.RIGHT):
        for open_loop in (False, True):
            _, damping = gains.of(support, open_loop)
            assert damping[[5, 11]].max() * dt / inertia < 2.0


@pytest.mark.sim
@pytest.mark.parametrize(("seed", "swing"), [(0, "sat"), (1, "smooth")])
def test_the_papers_gait_walks_in_open_loop_and_stops(seed: int, swing: str) -> None:
    walker = body(seed, paper_swing=swing)
    walker.go(12.0, (0.2, 0.0, 0.0))
    assert walker.motion.mode is MotionMode.WALK
    way = walker.world.truth().base_position[:2] - (START.x, START.y)
    assert np.linalg.norm(way) > 1.9  # of 2.1; starting takes a second
    walker.go(5.0)
    assert walker.motion.mode is MotionMode.STAND
    assert not walker.fallen


@pytest.mark.sim
def test_joint_angles_of_the_papers_gait_do_not_depend_on_what_is_measured() -> None:
    angles = []
    for seed in (0, 1):
        walker = body(seed)
        walker.go(3.0, (0.2, 0.0, 0.0))
        angles.append(walker.motion.state().joint_positions_desired)
    # The robots differ in mass, friction and sensors; what they began from is gone after some steps.
    np.testing.assert_allclose(angles[0], angles[1], atol=1e-4)


def gravity_torques(joints: np.ndarray[Any, np.dtype[np.float64]], stance_frame: str) -> list[float]:
    """Return the gradient of the potential energy of the robot rooted in a level sole, by finite differences."""
    model = floating_model(with_fixed_head(load_robot()))
    data, sole = model.createData(), model.getFrameId(stance_frame)
    weight = 9.81 * sum(inertia.mass for inertia in model.inertias)

    def energy(angles: np.ndarray[Any, np.dtype[np.float64]]) -> float:
        q = pin.neutral(model)
        q[7:] = angles
        com = pin.centerOfMass(model, data, q)
        pin.updateFramePlacements(model, data)
        return float(weight * (data.oMf[sole].inverse() * com)[2])

    h = 1e-6
    return [(energy(joints + h * unit) - energy(joints - h * unit)) / (2 * h) for unit in np.eye(12)]


@pytest.mark.sim
def test_gravity_feedforward_is_the_gradient_of_the_potential_energy_over_the_stance_foot() -> None:
    walker = body(feedforward="gravity")
    walker.go(1.3, (0.2, 0.0, 0.0))
    before = walker.motion.state()
    walker.tick(FORWARD)
    now = walker.motion.state()
    assert now.support is before.support and now.support in (Support.LEFT, Support.RIGHT)
    sole = frames.LEFT_SOLE if now.support is Support.LEFT else frames.RIGHT_SOLE
    expected = gravity_torques(before.joint_positions_desired, sole)
    # The desired sole is level but for what the inverse kinematics has left, some 0.1 mrad of 160 N m/rad.
    np.testing.assert_allclose(now.torque_feedforward, expected, atol=0.1)


@pytest.mark.sim
def test_without_feedforward_only_the_feedback_carries() -> None:
    walker = body(feedforward="none")
    state = walker.motion.state()
    np.testing.assert_array_equal(state.torque_feedforward, 0.0)
    assert np.abs(state.torque_feedback).max() > 5.0  # the knees hold 23 kg
    assert state.mode is MotionMode.STAND


@pytest.mark.sim
def test_the_planned_com_of_the_default_gait_moves_with_the_dcm_and_the_robot_follows_it() -> None:
    walker = body(gait="dcm")
    walker.go(4.0, (0.2, 0.0, 0.0))
    errors, planned = [], []
    omega = np.sqrt(9.81 / 0.71)
    for _ in range(200):
        walker.tick(FORWARD)
        state = walker.motion.state()
        planned.append(state.com_desired[:2])
        errors.append(float(np.linalg.norm(state.com[:2] - state.com_desired[:2])))
        dcm = state.com_desired[:2] + state.com_velocity_desired[:2] / omega
        np.testing.assert_allclose(dcm, state.dcm_desired, atol=1e-12)
    moved = planned[-1] - planned[0]
    assert moved[0] == pytest.approx(0.8 * 0.2, abs=0.05)
    assert np.sqrt(np.mean(np.square(errors))) < 0.02
