"""Recordings that cannot be this robot's are refused, and the message says why."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic_motion import changed, swaying_log

from tulip_description.robot import load_robot
from tulip_motion.identification.body_prior import Spread
from tulip_motion.identification.correlated_fit import Fit
from tulip_motion.identification.dynamic_checks import check_result
from tulip_motion.identification.dynamic_identification import dynamic_prior, identify_dynamics
from tulip_motion.identification.identification_error import IdentificationError
from tulip_motion.identification.motion_log import MotionLog
from tulip_motion.identification.zmp_regressor import ZmpRegressor
from tulip_motion.identification.zmp_rows import ZmpRows, zmp_rows

BELIEVED = load_robot()
TRUE = changed(BELIEVED, np.random.default_rng(11))
REGRESSOR = ZmpRegressor(BELIEVED)


@pytest.fixture(scope="module")
def log() -> MotionLog:
    return swaying_log(TRUE)


def rows_of(log: MotionLog) -> ZmpRows:
    return zmp_rows(REGRESSOR, log)


def test_weight_of_another_robot_is_refused_unless_a_larger_spread_is_stated(log: MotionLog) -> None:
    heavy = rows_of(replace(log, foot_cells=1.5 * log.foot_cells))
    with pytest.raises(IdentificationError, match=r"the cells weigh 33\.29 kg, the robot .* has 23\.00 kg"):
        identify_dynamics(REGRESSOR, [heavy])
    found = identify_dynamics(REGRESSOR, [heavy], Spread(mass=0.6, com=0.05))
    assert found.mass[0] == pytest.approx(1.5 * TRUE.mass, rel=0.01)


@pytest.mark.parametrize(
    ("order", "cells"), [((2, 3, 0, 1), "heel and toe cells"), ((1, 0, 3, 2), "inner and outer cells")]
)
def test_swapped_cells_are_named(log: MotionLog, order: tuple[int, ...], cells: str) -> None:
    with pytest.raises(IdentificationError, match=f"{cells} of both feet are swapped"):
        identify_dynamics(REGRESSOR, [rows_of(replace(log, foot_cells=log.foot_cells[:, :, list(order)]))])


@pytest.mark.parametrize(("shift", "refused"), [(0.06, False), (0.6, True)])
def test_trunk_whose_com_is_20_deviations_ahead_is_refused_and_3_are_not(shift: float, refused: bool) -> None:
    prior = dynamic_prior(BELIEVED)
    trunk = BELIEVED.links[0].mass
    parameters = prior.mean.copy()
    parameters[1] += trunk * shift  # mx(base_link); 2 cm is one deviation of the trunk alone
    told = Fit(parameters, 0.1 * prior.covariance, np.ones(3), np.ones(3), 30.0)
    if refused:
        words = r"beyond belief .* mx\(base_link\) is 1\.192 in the robot file and would be .* standard deviations away"
        with pytest.raises(IdentificationError, match=words):
            check_result(REGRESSOR, [], prior, told)
    else:
        check_result(REGRESSOR, [], prior, told)


def test_cop_of_another_motion_is_refused_with_the_number_of_its_recording(log: MotionLog) -> None:
    sound = rows_of(log)
    with pytest.raises(IdentificationError, match=r"in recording 2 of 2 the ZMP of the best body is"):
        identify_dynamics(REGRESSOR, [sound, sound._replace(rows=_exchanged_halves(sound))])


def _exchanged_halves(rows: ZmpRows) -> np.ndarray:
    """Return rows as if the CoP was that of half a recording later."""
    later = np.roll(rows.cop - rows.cop.mean(axis=0), len(rows.cop) // 2, axis=0)
    moved = rows.rows.copy()
    moved[:, :2] -= 5.0 * (later - rows.cop)[:, :, None] * rows.rows[:, 2:]
    return moved


def test_no_recordings_at_all_are_refused() -> None:
    with pytest.raises(IdentificationError, match="there are no recordings"):
        identify_dynamics(REGRESSOR, [])
