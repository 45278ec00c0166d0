"""The roads from two feet onto one."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from synthetic import base_rotation, com_by_pinocchio

from tulip_description.model import Side, floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.identification.static_postures import aim_point
from tulip_motion.identification.weight_shift import LIFT, weight_shift

ROBOT = load_robot()


def other_sole(side: Side, joints: np.ndarray) -> pin.SE3:
    model = floating_model(ROBOT)
    data, q = model.createData(), pin.neutral(model)
    q[7:] = joints
    pin.framesForwardKinematics(model, data, q)
    left, right = (data.oMf[model.getFrameId(name)] for name in ("l_sole", "r_sole"))
    return left.actInv(right) if side == "left" else right.actInv(left)


@pytest.mark.parametrize("side", ["left", "right"])
def test_shift_keeps_both_feet_where_they_stand_and_brings_the_com_over_one(side: Side):
    shift = weight_shift(ROBOT, side).shift
    start = other_sole(side, standing_posture(ROBOT).joint_positions)
    for share in np.linspace(0.0, 1.0, 21):
        joints = shift.position(share)
        now = other_sole(side, joints)
        assert now.translation == pytest.approx(start.translation, abs=1e-4)
        assert np.linalg.norm(pin.log3(now.rotation)) < 1e-3
        assert base_rotation(ROBOT, side, joints) == pytest.approx(np.eye(3), abs=1e-3)  # the trunk stays upright
    assert com_by_pinocchio(ROBOT, side, shift.position(1.0))[:2] == pytest.approx(aim_point(ROBOT, side), abs=1e-6)


@pytest.mark.parametrize("side", ["left", "right"])
def test_lift_takes_the_other_foot_straight_up_with_the_com_at_rest(side: Side):
    shift, lift = weight_shift(ROBOT, side)
    assert lift.position(0.0) == pytest.approx(shift.position(1.0), abs=1e-6)
    below = other_sole(side, lift.position(0.0)).translation
    for share in np.linspace(0.0, 1.0, 11):
        joints = lift.position(share)
        assert other_sole(side, joints).translation - below == pytest.approx([0.0, 0.0, share * LIFT], abs=2e-4)
        assert com_by_pinocchio(ROBOT, side, joints)[:2] == pytest.approx(aim_point(ROBOT, side), abs=1e-4)
