"""A harness: the simulated robot hangs from its trunk, as a real one does when it is first switched on."""

from __future__ import annotations

import numpy as np

from tulip_motion.lipm import GRAVITY
from tulip_sim.timing import TICK
from tulip_sim.world import World

LIFT = 0.10  # [m] the feet are free
STIFFNESS, DAMPING = 5000.0, 680.0  # [N/m], [N s/m] critically damped for 23 kg


class Harness:
    """Holds the trunk as a rope to a hook above would: no moments.

    For bringing up a driver alone; a robot that plays is never held.

    Args:
        world: Whose first robot is lifted from where it stands.
    """

    def __init__(self, world: World) -> None:
        self.world = world
        self._hook = world.truth().base_position + np.array([0.0, 0.0, LIFT])
        self._weight = np.array([0.0, 0.0, world.robot.mass * GRAVITY])

    def pull(self) -> None:
        """Pull for the next control tick; call it before each."""
        truth = self.world.truth()
        force = STIFFNESS * (self._hook - truth.base_position) - DAMPING * truth.base_linear_velocity
        self.world.push(force + self._weight, TICK)
