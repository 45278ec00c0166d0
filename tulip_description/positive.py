"""A check that parameters share: every number of a dataclass is positive."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import Any


def check_positive(parameters: Any, of: type | None = None) -> None:
    """Check that all fields are finite and positive.

    Args:
        parameters: Object of a dataclass of numbers.
        of: The dataclass whose fields count; by default all that the object has.

    Raises:
        ValueError: if one is not; the message names it.
    """
    for entry in fields(of or parameters):
        value = getattr(parameters, entry.name)
        if not (math.isfinite(value) and value > 0.0):
            raise ValueError(f"{entry.name} is {value}; expected a finite value > 0")
