"""What one static posture on one foot tells: the datum of the identification by eq. (2)."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_description.model import Side

Array = NDArray[np.float64]


@dataclass(frozen=True)
class StaticMeasurement:
    """Means of the sensors while the robot held one posture on one foot.

    Attributes:
        side: The stance foot, which alone touches the ground.
        joint_positions: (n,) of the encoders, order of `robot.joint_names` [rad].
        down: (3,) unit vector of gravity in base_link, as the IMU tells it. The sole need not lie level: on a soft
            floor it tilts, and the CoP then lies below the CoM along this direction, not along the sole's normal.
        cop: (2,) centre of pressure of the stance foot in its sole frame [m].
        cop_covariance: (2, 2) of that mean [m^2].
        cells: (4,) forces of the stance foot's cells, heel inner, heel outer, toe inner, toe outer [N].
    """

    side: Side
    joint_positions: Array
    down: Array
    cop: Array
    cop_covariance: Array
    cells: Array

    @property
    def normal_force(self) -> float:
        """Sum of the stance foot's cells [N]."""
        return float(self.cells.sum())

    def __post_init__(self) -> None:
        """Check shapes and numbers.

        Raises:
            ValueError: if one is of the wrong shape or cannot be.
        """
        if self.side not in ("left", "right"):
            raise ValueError(f"side is {self.side!r}; expected left or right")
        shapes = (("joint_positions", (len(self.joint_positions),)), ("down", (3,)), ("cop", (2,)), ("cells", (4,)))
        for name, shape in (*shapes, ("cop_covariance", (2, 2))):
            values = getattr(self, name)
            if values.shape != shape or not np.isfinite(values).all():
                raise ValueError(f"{name} is {values}; expected finite numbers of shape {shape}")
        if not math.isclose(float(self.down @ self.down), 1.0, rel_tol=1e-6):
            raise ValueError(f"down is {self.down}; expected a unit vector")
        if np.linalg.eigvalsh(self.cop_covariance)[0] <= 0.0:
            raise ValueError(f"cop_covariance is {self.cop_covariance}; expected a positive definite matrix")
        if not self.normal_force > 0.0:
            raise ValueError(f"normal_force is {self.normal_force} N; expected > 0")
