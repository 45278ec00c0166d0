"""Postures on one foot, drawn once for all tests: on the playing robot, and on none other than those it can hold."""

from __future__ import annotations

import numpy as np
import pytest
from synthetic import Held, postures

from tulip_description.robot import load_robot


@pytest.fixture(scope="session")
def held() -> Held:
    """40 postures to measure."""
    return postures(load_robot(), 40, np.random.default_rng([1, 0]))


@pytest.fixture(scope="session")
def unseen() -> Held:
    """200 postures to judge by."""
    return postures(load_robot(), 200, np.random.default_rng(7))
