"""Joint feedback, eq. (13): which gains hold which leg."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from tulip_motion.interface import Side, Support
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]


class JointGains:
    """K_P and K_D of eq. (13) for each phase: stiff legs carry, a soft one swings."""

    def __init__(self, parameters: MotionParameters) -> None:
        """Lay the gains of both legs out once, as they are needed every tick."""
        p = parameters
        self._closed_loop = _by_support(
            np.array([p.stance_stiffness, p.stance_damping]), np.array([p.swing_stiffness, p.swing_damping])
        )
        self._open_loop = _by_support(
            np.array([p.open_stance_stiffness, p.open_stance_damping]),
            np.array([p.open_swing_stiffness, p.open_swing_damping]),
        )
        self.limp: tuple[Array, Array] = (np.zeros(12), np.tile(np.array(p.limp_damping), len(Side)))

    def of(self, support: Support, open_loop: bool = False) -> tuple[Array, Array]:
        """Return (12,) stiffness [N m/rad] and (12,) damping [N m s/rad] for a support."""
        return (self._open_loop if open_loop else self._closed_loop)[int(support)]


def _by_support(stance: Array, swing: Array) -> dict[int, tuple[Array, Array]]:
    """Return (12,) stiffness and (12,) damping of both legs from the (2, 6) gains of one."""
    legs = {Support.DOUBLE: (stance, stance), Support.LEFT: (stance, swing), Support.RIGHT: (swing, stance)}
    gains = {int(support): np.hstack(pair) for support, pair in legs.items()}
    return {support: (stiffness, damping) for support, (stiffness, damping) in gains.items()}


def feedback(stiffness: Array, damping: Array, error: Array, error_rate: Array) -> Array:
    """Return tau_fb = K_P e + K_D e' [N m], eq. (13)."""
    result: Array = stiffness * error + damping * error_rate
    return result
