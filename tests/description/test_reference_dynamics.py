"""Eq. (1) of the team description against reference values of an independent derivation (tests/data/README.md)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

from tulip_description.model import floating_model, joint_indices, sole_model
from tulip_description.robot import load_robot

REFERENCE: dict[str, Any] = json.loads(
    (Path(__file__).parents[1] / "data" / "tulip_single_support_dynamics.json").read_text(encoding="utf-8")
)
CASES = REFERENCE["cases"]
# The reference counts each angle along the chain from the left sole, so the left leg's angles change their sign.
SIGN = np.array([-1.0] * 6 + [1.0] * 6)


def eq1(model: pin.Model, q: np.ndarray, dq: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return D, C q' and G."""
    data = model.createData()
    mass = pin.crba(model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    gravity = pin.computeGeneralizedGravity(model, data, q).copy()
    return mass, pin.rnea(model, data, q, dq, np.zeros(model.nv)) - gravity, gravity


def eq1_of_constrained_floating_model(
    side: str, joints: np.ndarray, rates: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return D, C q' and G of the floating-base model whose sole is held, in the order of LEG_JOINTS."""
    robot = load_robot("table")
    model = floating_model(robot)
    data = model.createData()
    q = np.concatenate([pin.neutral(model)[:7], joints])
    sole = model.getFrameId("l_sole" if side == "left" else "r_sole")
    pin.framesForwardKinematics(model, data, q)
    sole_in_base = data.oMf[sole].copy()
    jacobian = pin.computeFrameJacobian(model, data, q, sole, pin.LOCAL)
    to_base = np.linalg.inv(jacobian[:, :6])
    motion = np.vstack([-to_base @ jacobian[:, 6:], np.eye(12)])  # v = motion @ rates keeps the sole still
    v = motion @ rates
    pin.forwardKinematics(model, data, q, v, np.zeros(model.nv))
    drift = pin.getFrameAcceleration(model, data, sole, pin.LOCAL).vector
    a = np.concatenate([-to_base @ drift, np.zeros(12)])
    model.gravity = pin.Motion(sole_in_base.rotation @ np.array([0.0, 0.0, -9.81]), np.zeros(3))  # up is the sole's z
    gravity = pin.computeGeneralizedGravity(model, data, q).copy()
    bias = pin.rnea(model, data, q, v, a) - gravity
    mass = pin.crba(model, data, q)
    mass = np.triu(mass) + np.triu(mass, 1).T
    return motion.T @ mass @ motion, motion.T @ bias, motion.T @ gravity


@pytest.mark.parametrize("case", range(len(CASES)))
def test_left_rooted_model_equals_reference(case: int) -> None:
    reference = CASES[case]
    model = sole_model(load_robot("table"), "left")
    mass, coriolis, gravity = eq1(model, SIGN * reference["q"], SIGN * reference["dq"])
    np.testing.assert_allclose(SIGN[:, None] * mass * SIGN, np.reshape(reference["M_rowmajor"], (12, 12)), atol=1e-9)
    np.testing.assert_allclose(SIGN * coriolis, reference["C_dq"], atol=1e-9)
    np.testing.assert_allclose(SIGN * gravity, reference["G"], atol=1e-4)  # its constants are rounded to 6 digits


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("case", range(len(CASES)))
def test_sole_rooted_model_equals_constrained_floating_model(case: int, side: str) -> None:
    robot = load_robot("table")
    model = sole_model(robot, side)
    order = joint_indices(model, robot)
    chain_q, chain_dq = SIGN * CASES[case]["q"], SIGN * CASES[case]["dq"]
    expected = eq1(model, chain_q, chain_dq)
    mass, coriolis, gravity = eq1_of_constrained_floating_model(side, chain_q[order], chain_dq[order])
    np.testing.assert_allclose(mass, expected[0][np.ix_(order, order)], atol=1e-9)
    np.testing.assert_allclose(coriolis, expected[1][order], atol=1e-9)
    np.testing.assert_allclose(gravity, expected[2][order], atol=1e-9)
