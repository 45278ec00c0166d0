"""Ranges of the parameters of motion control: what each number has to be, so that no formula breaks."""

from __future__ import annotations

import math
from collections.abc import Mapping

SIGNED = frozenset({"zmp_forward", "zmp_inward", "paper_zmp_inward", "kick_zmp_inward"}) | frozenset(
    {"walking_kick_reach_back", "walking_kick_reach_ahead", "learning_gamma_cross"}
)
"""Places on either side of something, and one entry of a matrix; all other numbers are 0 or more."""

POSITIVE = frozenset(
    {
        *("control_period", "com_height", "step_time", "double_support_time", "first_shift_time", "stop_shift_time"),
        *("stance_width", "min_foot_distance", "paper_step_time", "max_step_time_rate", "max_swing_speed"),
        *("max_speed_forward", "max_speed_backward", "max_speed_sideways", "max_turn_rate", "ball_radius"),
        *("max_speed_change", "max_turn_change", "goal_tolerance", "goal_tolerance_yaw", "step_time_weight"),
        *("kick_shift_time", "kick_lift_time", "kick_return_time", "kick_lower_time", "kick_brake_time"),
        *("kick_slip_time", "kick_backswing", "kick_shortest_backswing", "kick_follow_through", "kick_speed_ratio"),
        *("side_kick_backswing", "side_kick_shortest_backswing", "side_kick_follow_through", "side_kick_speed_ratio"),
        *("walking_kick_step_time", "walking_kick_speed_ratio", "walking_kick_steps", "imu_bias_time"),
        *("learning_patience", "learning_beta", "fall_confirm_time"),
    }
)
"""What is divided by, or what nothing moves without."""

SHARES = frozenset({"ankle_share", "reach_share", "contact_phase", "walking_kick_contact"})
"""Above 0, and at most 1."""


def check_numbers(values: Mapping[str, object]) -> None:
    """Check all numbers among parameters.

    Args:
        values: By name.

    Raises:
        ValueError: if one is not finite or out of its range; the message says which, and what was expected.
    """
    for name, value in values.items():
        numbers = value if isinstance(value, tuple) else (value,)
        for number in numbers:
            if isinstance(number, int | float) and not isinstance(number, bool):
                expected = _refusal(name, number)
                if expected:
                    raise ValueError(f"{name} is {value}; expected {expected}")


def _refusal(name: str, number: float) -> str:
    """Return what was expected of a number, or "" if it is so."""
    if not math.isfinite(number):
        return "finite numbers"
    if name in SHARES:
        return "" if 0.0 < number <= 1.0 else "above 0 and at most 1"
    if name in POSITIVE:
        return "" if number > 0.0 else "> 0"
    return "" if name in SIGNED or number >= 0.0 else ">= 0"
