"""Friction (D6) from made-up torques, and from a short swing of a leg in the simulator."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_motion import changed, swaying_log

from tulip_description.planar import Pose2D
from tulip_description.robot import LEG_JOINTS, load_robot
from tulip_motion.identification.exciting_motions import leg_swing
from tulip_motion.identification.inertial_prior import inertial_prior
from tulip_motion.identification.joint_friction import FrictionParameters, identify_friction
from tulip_motion.identification.motion_log import MotionLog
from tulip_motion.identification.zmp_regressor import ZmpRegressor
from tulip_motion.interface import Side
from tulip_sim.excited_log import excited_log
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.secret_body import secret_body
from tulip_sim.world import World

BELIEVED = load_robot()
TRUE = changed(BELIEVED, np.random.default_rng(3))
REGRESSOR = ZmpRegressor(BELIEVED)
COULOMB = np.linspace(0.2, 0.9, 14)
VISCOUS = np.linspace(0.5, 0.1, 14)
SPEED = 0.1  # [rad/s]
RIGHT = LEG_JOINTS[6:]


@pytest.fixture(scope="module")
def log() -> MotionLog:
    return swaying_log(TRUE, joint_amplitude=0.3, trunk_amplitude=0.02, friction=(COULOMB, VISCOUS, SPEED))


def test_both_frictions_are_found_in_spite_of_a_wrong_body(log: MotionLog) -> None:
    result = identify_friction(REGRESSOR, [log], inertial_prior(BELIEVED))
    assert result.coulomb_speed == SPEED
    assert set(result.joints) == set(RIGHT)  # the left foot stands
    for name in RIGHT:
        joint, found = BELIEVED.joint_names.index(name), result.joints[name]
        deviations = np.sqrt(np.diag(found.covariance))
        assert found.coulomb == pytest.approx(COULOMB[joint], rel=0.1)
        assert found.viscous == pytest.approx(VISCOUS[joint], rel=0.1)
        assert found.offset == pytest.approx(0.0, abs=max(0.02, 4.0 * deviations[2]))


def test_offset_of_a_torque_sensor_does_not_become_friction(log: MotionLog) -> None:
    knee = RIGHT[3]
    biased = replace(log, joint_efforts=log.joint_efforts + 0.3 * (np.array(BELIEVED.joint_names) == knee))
    found = identify_friction(REGRESSOR, [biased], inertial_prior(BELIEVED)).joints[knee]
    assert found.coulomb == pytest.approx(COULOMB[BELIEVED.joint_names.index(knee)], rel=0.1)
    assert found.offset > 0.1


def test_joint_that_hardly_moves_is_refused_by_name_and_the_others_are_not(log: MotionLog) -> None:
    positions = log.joint_positions.copy()
    knee = BELIEVED.joint_names.index("right_knee")
    positions[:, knee] = positions[0, knee]
    result = identify_friction(REGRESSOR, [replace(log, joint_positions=positions)], inertial_prior(BELIEVED))
    assert "right_knee" not in result.joints
    assert "moved forwards faster than 0.15 rad/s for 0.00 s only" in result.refused["right_knee"]
    assert "right_hip_pitch" in result.joints


def test_friction_that_drives_a_joint_is_refused_by_name(log: MotionLog) -> None:
    knee = np.array(BELIEVED.joint_names) == "right_knee"
    swapped = log.joint_efforts - 2.0 * knee * (log.joint_efforts - _frictionless().joint_efforts)
    result = identify_friction(REGRESSOR, [replace(log, joint_efforts=swapped)], inertial_prior(BELIEVED))
    assert "friction is never negative" in result.refused["right_knee"]
    assert set(result.joints) == set(RIGHT) - {"right_knee"}


def _frictionless() -> MotionLog:
    return swaying_log(TRUE, joint_amplitude=0.3, trunk_amplitude=0.02)


def test_log_in_which_no_leg_swings_is_refused() -> None:
    standing = swaying_log(BELIEVED, seconds=2.0, joint_amplitude=0.02, on_one_foot=False)
    with pytest.raises(ValueError, match="no leg joint moved enough while its leg swung"):
        identify_friction(REGRESSOR, [standing], inertial_prior(BELIEVED))


@pytest.mark.sim
def test_swing_in_the_simulator_gives_its_joints_friction_within_the_stated_error() -> None:
    world = WorldParameters(mass_spread=0.0)
    true = secret_body(BELIEVED, np.random.default_rng(21))
    log = excited_log(leg_swing(Side.LEFT, duration=10.0), true, BELIEVED, 3, world)
    result = identify_friction(
        REGRESSOR, [log], inertial_prior(BELIEVED), FrictionParameters(coulomb_speeds=(world.joint_friction_speed,))
    )
    drawn = World(Scenario(robot=Pose2D(), ball=(1.0, 1.0), poles=False), world, 3)
    dry = drawn.robots[0].dry_friction
    drawn.close()
    assert set(result.joints) == set(RIGHT)
    for name in RIGHT:
        expected = dry[BELIEVED.joint_names.index(name)] * np.tanh(1.0 / world.joint_friction_speed)
        torque, deviation = result.joints[name].torque(1.0, result.coulomb_speed)
        assert deviation < 0.1, name
        assert abs(torque - expected) < 4.0 * deviation, name
