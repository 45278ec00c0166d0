"""Bad parameters of motion control: each is refused with its name and with what was expected."""

from __future__ import annotations

import math
from dataclasses import fields, replace

import pytest

from tulip_motion.parameter_ranges import POSITIVE, SHARES, SIGNED
from tulip_motion.parameters import MotionParameters

P = MotionParameters()
NUMBERS = [field.name for field in fields(P) if type(getattr(P, field.name)) in (int, float)]
SIXES = [field.name for field in fields(P) if isinstance(getattr(P, field.name), tuple)]


def test_ranges_speak_of_parameters_only() -> None:
    assert set(NUMBERS) >= POSITIVE | SHARES | SIGNED
    assert not POSITIVE & SHARES | POSITIVE & SIGNED | SHARES & SIGNED


@pytest.mark.parametrize("name", NUMBERS)
def test_a_number_that_is_not_finite_or_out_of_its_range_is_refused_by_name(name: str) -> None:
    for value in (math.nan, math.inf, *(() if name in SIGNED else (-1.0,)), *((0.0,) if name in POSITIVE else ())):
        with pytest.raises(ValueError, match=f"^{name} is {value}; expected "):
            replace(P, **{name: value})


@pytest.mark.parametrize("name", SIXES)
def test_gains_of_a_leg_are_six_numbers_of_0_or_more(name: str) -> None:
    for values, expected in (
        ((1.0,) * 5, "expected six numbers"),
        ((1.0, -1.0, 1.0, 1.0, 1.0, 1.0), "expected >= 0"),
        ((math.nan,) * 6, "expected finite numbers"),
    ):
        with pytest.raises(ValueError, match=expected) as caught:
            replace(P, **{name: values})
        assert str(caught.value).startswith(f"{name} is (")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"gait": "trott"}, "gait is 'trott'; expected dcm or paper"),
        ({"learning": "x"}, "learning is 'x'; expected none or adaptive or waveform"),
        ({"learning_gain": 3.0}, "learning_gain is 3.0; expected 0 to 1"),
        ({"learning_margin": 1.0}, "learning_margin is 1.0; expected > 1"),
        ({"paper_swing": "foo"}, "paper_swing is 'foo'; expected sat or smooth"),
        ({"double_support_time": 0.4}, "double_support_time is 0.4 s; expected less than step_time"),
        ({"walking_kick_step_time": 0.05}, "expected less than walking_kick_step_time, 0.05 s"),
        ({"ankle_share": 0.0}, "ankle_share is 0.0; expected above 0 and at most 1"),
        ({"learning_gamma_cross": 9.0}, "expected a positive semidefinite Gamma"),
        ({"gait": "paper", "paper_step_time": 0.9}, "brings the feet of gait paper to"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(changes: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        replace(P, **changes)
