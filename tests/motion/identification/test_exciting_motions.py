"""Exciting motions on a robot whose joints follow at once: where they lead, and that it would not fall."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.identification.exciting_motions import LEANS, SQUATS, SWAYS, Excitation, ExcitingMotion, leg_swing
from tulip_motion.interface import Side

ROBOT = load_robot()
MODEL = floating_model(ROBOT)
TICK = 4_000_000  # [ns]


def followed(excitation: Excitation) -> np.ndarray:
    """Return (t, 14) the joint positions that it leads through."""
    motion = ExcitingMotion(excitation, ROBOT)
    joints, upright = standing_posture(ROBOT).joint_positions, np.array([0.0, 0.0, 0.0, 1.0])
    way, stamp = [joints], 0
    while not motion.finished(stamp):
        command = motion.tick(
            Sensors(stamp, joints, np.zeros(14), np.zeros(14), upright, np.zeros(3), np.zeros(3), np.zeros((2, 4)))
        )
        assert command.names == ROBOT.joint_names
        joints, stamp = command.position, stamp + TICK
        way.append(joints)
        assert motion.notes == ()
    return np.array(way)


def soles_and_com(joints: np.ndarray) -> tuple[list[pin.SE3], np.ndarray]:
    data = MODEL.createData()
    q = np.concatenate([[0, 0, 0, 0, 0, 0, 1], joints])
    com = pin.centerOfMass(MODEL, data, q)
    pin.framesForwardKinematics(MODEL, data, q)
    return [data.oMf[MODEL.getFrameId(name)] for name in ("l_sole", "r_sole")], com


@pytest.mark.parametrize("excitation", [SQUATS, SWAYS, LEANS], ids=["squats", "sways", "leans"])
def test_on_two_feet_the_soles_stay_flat_where_they_are_and_the_com_between_them(excitation: Excitation) -> None:
    way = followed(excitation)
    (left, right), _ = soles_and_com(way[0])
    before = left.inverse() * right
    for joints in way[::25]:
        (left, right), com = soles_and_com(joints)
        moved = (left.inverse() * right).inverse() * before
        assert np.linalg.norm(moved.translation) < 2e-3
        assert np.linalg.norm(pin.log3(moved.rotation)) < 5e-3
        forward, sideways, height = left.actInv(com)
        assert -0.03 < forward < 0.12
        assert -0.24 < sideways < 0.0
        assert 0.55 < height < 0.75
    np.testing.assert_allclose(way[-1], way[0], atol=2e-3)
    assert np.ptp(way[:, 12:], axis=0).min() > 0.5  # the head looks round


@pytest.mark.parametrize("stance", Side)
def test_on_one_foot_the_com_stays_above_it_while_the_other_leg_is_fast_enough_for_friction(stance: Side) -> None:
    way = followed(leg_swing(stance))
    rates = np.abs(np.gradient(way, 0.004, axis=0)).max(axis=0)
    leg = slice(0, 6) if stance is Side.RIGHT else slice(6, 12)
    assert rates[leg].min() > 0.6
    lifted = 0
    for joints in way[::25]:
        soles, com = soles_and_com(joints)
        foot = soles[stance]
        height = foot.actInv(soles[stance.other].translation)[2]
        if height > 5e-3:
            lifted += 1
            forward, sideways, _ = foot.actInv(com)
            assert abs(forward - 0.04) < 0.02
            assert abs(sideways) < 0.01
            assert abs(foot.actInv(soles[stance.other].translation)[1]) > 0.16  # the feet do not meet
    assert lifted > 0.5 * len(way[::25])
    np.testing.assert_allclose(way[-1], way[0], atol=3e-3)
