from __future__ import annotations

import math
from dataclasses import dataclass

import pytest

from tulip_description.positive import check_positive


@dataclass
class Base:
    width: float = 1.0


@dataclass
class Wider(Base):
    depth: float = 2.0


@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf])
def test_the_number_that_is_not_positive_is_named(value: float) -> None:
    check_positive(Wider())
    with pytest.raises(ValueError, match=f"depth is {value}; expected a finite value > 0"):
        check_positive(Wider(depth=value))
    check_positive(Wider(depth=value), Base)
