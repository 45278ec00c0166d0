"""Numbers that are short in binary.

The last digits of a computed number are noise, which no compression makes smaller: numbers without them take a third of
the space in a recording.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def fixed_point(values: Array, digits: int = 16) -> Array:
    """Return the nearest multiples of 2^-digits; what is not a number stays so.

    Args:
        values: Of any shape.
        digits: After the binary point. 16 are 1.5e-5: 0.015 mm, 0.001 degrees.

    Example:
        >>> fixed_point(np.array([0.1, -1.0, np.nan])).tolist()
        [0.100006103515625, -1.0, nan]
    """
    scale = 2.0**digits
    rounded: Array = np.rint(values * scale) * (1.0 / scale)
    return rounded


def significant(values: Array, digits: int = 12) -> Array:
    """Return the nearest numbers with so many binary digits, for what spans many powers of ten: covariances.

    Args:
        values: Of any shape.
        digits: From the first one that is not zero. 12 are 1 in 4000.

    Example:
        >>> significant(np.array([1.0, 1e-6]), 4).tolist()
        [1.0, 1.0132789611816406e-06]
    """
    fraction, exponent = np.frexp(values)
    rounded: Array = np.ldexp(np.rint(fraction * 2.0**digits), exponent - digits)
    return rounded
