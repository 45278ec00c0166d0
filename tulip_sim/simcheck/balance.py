"""Energy and momentum of a recording, and what of them is not accounted for.

Everything is computed with Pinocchio from states that were read back, so it says the same of any engine.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from tulip_description.materials import GRAVITY
from tulip_description.model import floating_model
from tulip_description.quaternion import quaternion_matrix
from tulip_description.robot import Robot
from tulip_sim.simcheck.engine import Recording

Array = NDArray[np.float64]


class Balance(NamedTuple):
    """What a recording shows, at its T + 1 states.

    One step of the simulator computes the velocity at its end first, and moves with it (semi-implicit Euler). A force f
    then works f v+ h, while the kinetic energy grows by less, by f (v- + v+) h / 2: the step swallows dv^T D dv / 2,
    dv = v+ - v-. For a constant force that is its work on the way a h^2 / 2 that the step goes too far; for an impact
    it is just the energy that a plastic impact takes (Carnot).

    Attributes:
        com: (T + 1, 3) centre of mass in map [m].
        kinetic, potential: (T + 1,) [J].
        work: (T + 1,) done so far by joints and pushes [J].
        fed: (T + 1,) power that the weight feeds in, without what a push takes out again [W].
        swallowed: (T + 1,) sum of dv^T D dv / 2 over the milliseconds so far [J].
        momentum: (T + 1, 3) linear, in map [N s].
        spin: (T + 1, 3) angular about the CoM, in map [N m s].
        momentum_error: (T + 1, 3) change of momentum that weight, pushes and ground do not explain [N s].
        spin_error: (T + 1, 3) the same of the spin [N m s].
    """

    com: Array
    kinetic: Array
    potential: Array
    work: Array
    fed: Array
    swallowed: Array
    momentum: Array
    spin: Array
    momentum_error: Array
    spin_error: Array

    @property
    def energy_error(self) -> Array:
        """(T + 1,) change of energy that no work explains [J]: 0 in the air, less where the ground takes energy."""
        energy = self.kinetic + self.potential
        error: Array = energy - energy[0] - self.work
        return error


def balance(robot: Robot, run: Recording) -> Balance:
    """Return the balance of a recording.

    The torques are constant through a millisecond, so they work tau (q_k+1 - q_k) exactly, and so does a push on the
    way of the trunk's CoM. Moments of pushes and contacts about the CoM take its place in the middle of a millisecond.
    """
    model = floating_model(robot)
    data = model.createData()
    trunk_com, rows = np.array(robot.links[0].com), []
    for q, v in zip(run.q, run.v, strict=True):
        pin.computeCentroidalMomentum(model, data, q, v)
        h, com = data.hg, data.com[0].copy()
        kinetic = pin.computeKineticEnergy(model, data, q, v)
        potential = pin.computePotentialEnergy(model, data, q)
        rotation = quaternion_matrix(q[3:7].tolist())
        trunk = q[:3] + rotation @ trunk_com
        trunk_speed = rotation @ (v[:3] + np.cross(v[3:6], trunk_com))
        rows.append((com, kinetic, potential, h.linear.copy(), h.angular.copy(), trunk, trunk_speed))
    com, kinetic, potential, momentum, spin, trunk, trunk_speed = (
        np.array(column) for column in zip(*rows, strict=True)
    )
    work = (run.efforts * np.diff(run.joints, axis=0)).sum(axis=1) + (run.push * np.diff(trunk, axis=0)).sum(axis=1)
    weight = np.array([0.0, 0.0, -GRAVITY * robot.mass])
    pushed = 1e-3 * run.push
    middle, arm = (com[:-1] + com[1:]) / 2, ((trunk - com)[:-1] + (trunk - com)[1:]) / 2
    given = pushed + run.contact[:, :3] + 1e-3 * weight
    turned = np.cross(arm, pushed) + run.contact[:, 3:] - np.cross(middle, run.contact[:, :3])
    return Balance(
        com,
        kinetic,
        potential,
        _sums(work),
        (trunk_speed * np.concatenate([run.push, run.push[-1:]])).sum(axis=1) - GRAVITY * momentum[:, 2],
        _sums(np.array([_swallowed(model, data, run, k) for k in range(len(run.efforts))])),
        momentum,
        spin,
        momentum - momentum[0] - _sums(given),
        spin - spin[0] - _sums(turned),
    )


def _swallowed(model: pin.Model, data: pin.Data, run: Recording, k: int) -> float:
    """Return the kinetic energy of the change of velocity in a millisecond [J]."""
    turn = quaternion_matrix(run.q[k + 1, 3:7].tolist()).T @ quaternion_matrix(run.q[k, 3:7].tolist())
    change = run.v[k + 1].copy()
    change[:3] -= turn @ run.v[k, :3]
    change[3:6] -= turn @ run.v[k, 3:6]
    change[6:] -= run.v[k, 6:]
    return float(pin.computeKineticEnergy(model, data, run.q[k + 1], change))


def _sums(steps: Array) -> Array:
    """Return the sums of the first 0, 1, ... steps."""
    return np.concatenate([np.zeros_like(steps[:1]), np.cumsum(steps, axis=0)])
