"""The signs of a fall, each for itself."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tulip_motion.fall_detection import FallDetector, beyond_feet, predicted_tilt
from tulip_motion.parameters import MotionParameters

P = MotionParameters()
TICKS = round(P.fall_confirm_time / P.control_period)
STILL = np.zeros(3)
LEVEL = np.eye(3)
BELOW = np.array([P.zmp_forward, 0.0])
SOLES = ((0.0, 0.12, 0.0), (0.0, -0.12, 0.0))


def ask(rotation: np.ndarray, rate: np.ndarray, dcm: np.ndarray, ticks: int = TICKS) -> str:
    detector = FallDetector(P)
    return [detector.is_falling(rotation, rate, dcm, SOLES) for _ in range(ticks)][-1]


@pytest.mark.parametrize("yaw", [0.0, 2.0])
@pytest.mark.parametrize("lean", [(0.3, 0.0), (0.0, -0.3), (0.2, 0.2)])
def test_predicted_tilt_is_the_tilt_after_the_horizon(lean: tuple[float, float], yaw: float) -> None:
    rate = np.array([*lean, 0.0]) / 0.2  # leaning on about the same axis
    rotation = Rotation.from_rotvec([*lean, 0.0]).as_matrix() @ Rotation.from_euler("z", yaw).as_matrix()
    tilt, predicted = predicted_tilt(rotation, rate, 0.1)
    assert tilt == pytest.approx(math.hypot(*lean), abs=1e-9)
    later = Rotation.from_rotvec(0.1 * rate).as_matrix() @ rotation
    assert predicted == pytest.approx(math.acos(later[2, 2]), abs=0.01)  # of second order in tilt and step


def test_turning_about_the_vertical_does_not_predict_a_lean() -> None:
    assert predicted_tilt(LEVEL, np.array([0.0, 0.0, 3.0]), 0.2)[1] == pytest.approx(0.0, abs=1e-12)


def test_a_fast_lean_is_a_fall_while_the_torso_still_stands_straight() -> None:
    rate = np.array([0.0, 1.1 * P.fall_tilt / P.fall_horizon, 0.0])
    assert "leans 0 deg" in ask(LEVEL, rate, BELOW)
    assert ask(LEVEL, 0.8 * rate, BELOW) == ""


def test_a_sign_counts_only_when_it_lasts() -> None:
    rate = np.array([0.0, 5.0, 0.0])
    assert ask(LEVEL, rate, BELOW, TICKS - 1) == ""
    detector = FallDetector(P)
    for _ in range(3 * TICKS):
        assert detector.is_falling(LEVEL, rate, BELOW, SOLES) == ""
        assert detector.is_falling(LEVEL, STILL, BELOW, SOLES) == ""


def test_a_dcm_out_of_reach_needs_a_lean_besides() -> None:
    far = np.array([0.7, 0.0])
    lean = Rotation.from_euler("y", 1.1 * P.fall_lean).as_matrix()
    assert "beyond every foothold" in ask(lean, STILL, far)
    assert ask(LEVEL, STILL, far) == ""
    assert ask(lean, STILL, np.array([0.4, 0.0])) == ""


@pytest.mark.parametrize(
    ("dcm", "expected"),
    [((0.34, 0.1), (0.3, 0.0)), ((0.04, 0.32), (0.0, 0.2)), ((-0.06, -0.22), (-0.1, -0.1)), ((0.04, 0.0), (0.0, 0.0))],
)
def test_distance_from_the_feet_is_zero_between_them(dcm: tuple[float, float], expected: tuple[float, float]) -> None:
    assert beyond_feet(LEVEL, np.array(dcm), SOLES, 0.04) == pytest.approx(expected, abs=1e-12)


def test_upright_again_only_straight_still_high_and_on_both_feet() -> None:
    good = (LEVEL, STILL, 1.0, (100.0, 100.0))
    bad = [
        (Rotation.from_euler("x", 0.3).as_matrix(), STILL, 1.0, (100.0, 100.0)),
        (LEVEL, np.array([2.0, 0.0, 0.0]), 1.0, (100.0, 100.0)),
        (LEVEL, STILL, 0.7, (100.0, 100.0)),
        (LEVEL, STILL, 1.0, (200.0, 0.0)),
    ]
    for state in bad:
        detector = FallDetector(P)
        assert not any(detector.is_upright(*state) for _ in range(3 * TICKS))
        assert [detector.is_upright(*good) for _ in range(TICKS)] == [False] * (TICKS - 1) + [True]
