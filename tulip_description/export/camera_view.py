"""What a pinhole camera sees: all that other programs' cameras know of a lens."""

from __future__ import annotations

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class CameraView:
    """A camera without distortion.

    Attributes:
        width, height: Of its picture [px].
        focal_length: [px].
        rate: Pictures a second [Hz].
    """

    width: int
    height: int
    focal_length: float
    rate: float

    @property
    def horizontal_angle(self) -> float:
        """Field of view from left to right [rad]."""
        return 2.0 * math.atan(self.width / (2.0 * self.focal_length))

    @property
    def vertical_angle(self) -> float:
        """Field of view from top to bottom [rad]."""
        return 2.0 * math.atan(self.height / (2.0 * self.focal_length))
