"""How well a robot follows what its motion control wants."""

from __future__ import annotations

import numpy as np

from tulip_motion.interface import MotionState


class Tracking:
    """Errors, tick by tick, of the joints against q_d, of the CoM against its plan, of the CoP against the ZMP.

    The CoM is the estimated one, the CoP the measured one, the ZMP the commanded one.
    """

    def __init__(self) -> None:
        self._squares: list[tuple[float, float, float]] = []

    def __len__(self) -> int:
        return len(self._squares)

    def add(self, state: MotionState) -> None:
        """Take the state after a tick."""
        joints = state.joint_positions - state.joint_positions_desired
        com, zmp = (state.com - state.com_desired)[:2], state.zmp - state.zmp_desired
        self._squares.append((float((joints**2).mean()), float((com**2).sum()), float((zmp**2).sum())))

    def rms(self, ticks: int | None = None) -> tuple[float, float, float]:
        """Return RMS errors of joints [mrad], CoM [mm] and ZMP [mm] over the first ticks, by default all."""
        # Without contact, in the air, there is no ZMP.
        joint, com, zmp = (1000.0 * value for value in np.sqrt(np.nanmean(self._squares[:ticks], axis=0)).tolist())
        return joint, com, zmp
