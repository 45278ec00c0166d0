"""Iterative learning control over steps, eqs. (16)-(18): what one step teaches the next.

Left and right steps are mirrored repetitions of one motion. A law therefore works on a step seen from its stance leg:
the six joints of the stance leg first, then those of the swing leg, with the yaw and roll of a right-footed step turned
round. A memory holds what was learned at N nodes of the step's phase. Steps of about the same velocity share one
memory; each such class of steps is called a situation (step_learning.py).
"""

from __future__ import annotations

import math
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from tulip_motion.interface import Side
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]

SWAP = np.r_[6:12, 0:6]
"""Indices that exchange the legs in an array of 12."""
SIGNS = np.tile([-1.0, -1.0, 1.0, 1.0, 1.0, -1.0], 2)
"""Yaw and roll of a leg turn the other way in the mirror."""


def mirrored(values: Array) -> Array:
    """Return joint values (..., 12) as seen in a mirror: legs exchanged, yaw and roll turned round."""
    result: Array = values[..., SWAP] * SIGNS
    return result


def nodes_of(parameters: MotionParameters) -> int:
    """Return how many nodes a memory has: one a tick of an undisturbed step."""
    return round(parameters.step_time / parameters.control_period)


def on_nodes(phases: Array, values: Array, nodes: int, lead: float) -> Array:
    """Return the values (ticks, 12) of a step at the nodes (nodes, 12), `lead` later than the nodes are.

    Zero where the step had ended: what was not seen teaches nothing.

    Args:
        phases: (ticks,) rising from 0 to at most 1.
        values: (ticks, 12) one row a tick.
        nodes: How many nodes, at phases (i + 1/2) / nodes.
        lead: In phase.
    """
    wanted = (np.arange(nodes) + 0.5) / nodes + lead
    indices = np.searchsorted(phases, wanted)
    result = values[np.minimum(indices, len(values) - 1)]
    result[indices >= len(values)] = 0.0
    return result


class Law(Protocol):
    """A way to learn."""

    shape: tuple[int, ...]
    """Of the memory of one situation."""

    def playable(self, memory: Array, side: Side) -> Array:
        """Return the memory of a step on a stance side in the order of LEG_JOINTS, one row a node."""

    def torque(self, row: Array, error_rate: Array) -> Array:
        """Return (12,) tau_ILC [N m] from the present row and e' (12,) [rad/s]."""

    def learn(
        self, memory: Array, side: Side, phases: Array, rates: Array, feedback: Array, neighbour: Array | None
    ) -> None:
        """Change the memory by what a step showed.

        Args:
            memory: Of the step's situation; changed in place.
            side: Stance side of the step.
            phases: (ticks,) of the step.
            rates: (ticks, 12) e' [rad/s], order of LEG_JOINTS.
            feedback: (ticks, 12) K_P e + K_D e' [N m], order of LEG_JOINTS.
            neighbour: Memory of the situation of the steps before and after, or None if unknown.
        """


class AdaptiveLaw:
    """The paper's law: tau_k(t) = eta(e'_k) theta_k(t), theta_k = theta_(k-1) + Gamma eta^T e'_k, eqs. (16)-(18).

    eta = [e', tanh(beta e')] for each joint, theta (2,) a function of the phase: a damping and a dry friction.
    Source: Tayebi, "Adaptive iterative learning control for robot manipulators", Automatica 2004.

    eta^T e' is never negative, so theta as printed can only grow, on the noise of e' as well as on errors. The proof
    lets it, since its plant has no delay; here both terms are a gain on a velocity that is up to 6 ms old and noisy,
    and beyond a bound the joint oscillates. So theta leaks by a share each step (on noise alone it then settles
    at Gamma E[eta^T e'] / leak) and is clamped where theta_1 + beta theta_2, the damping that it adds about e' = 0,
    stays a share of the joint's own. Units: theta_1 and beta theta_2 are shares of the swing leg's K_D, which scales
    Gamma from joint to joint.

    Both sides share one theta: it has no sign that a mirror could turn.
    """

    def __init__(self, parameters: MotionParameters) -> None:
        """Make the law."""
        p = parameters
        self._nodes = nodes_of(p)
        self.shape: tuple[int, ...] = (1, self._nodes, 12, 2)
        self._damping = np.array(p.swing_damping * 2)
        self._beta = p.learning_beta
        self._gamma = np.array(
            [[p.learning_gamma_rate, p.learning_gamma_cross], [p.learning_gamma_cross, p.learning_gamma_sign]]
        )
        self._keep = 1.0 - p.learning_leak
        self._most = p.learning_damping_bound * np.array([0.5, 0.5 / p.learning_beta])

    def playable(self, memory: Array, side: Side) -> Array:
        """Return (N, 2, 12) theta times K_D, order of LEG_JOINTS."""
        theta = memory[0] if side is Side.LEFT else memory[0][:, SWAP]
        result: Array = np.ascontiguousarray(theta.transpose(0, 2, 1)) * self._damping
        return result

    def torque(self, row: Array, error_rate: Array) -> Array:
        """Return eta theta [N m], eq. (16)."""
        result: Array = row[0] * error_rate + row[1] * np.tanh(self._beta * error_rate)
        return result

    def learn(
        self, memory: Array, side: Side, phases: Array, rates: Array, feedback: Array, neighbour: Array | None
    ) -> None:
        """Apply eq. (18), then leak and clamp."""
        e = on_nodes(phases, rates, self._nodes, 0.0)
        if side is Side.RIGHT:
            e = mirrored(e)
        eta = np.stack([e, np.tanh(self._beta * e)], axis=-1)
        theta = memory[0]
        theta *= self._keep
        theta += (eta @ self._gamma.T) * e[..., None]
        np.clip(theta, 0.0, self._most, out=theta)


class WaveformLaw:
    """A torque over the step for each joint, learned from the feedback torque that was needed.

    W(t) <- Q (W(t) + gain (K_P e(t + lead) + K_D e'(t + lead))): what the feedback had to add in one step, the next
    ones add in advance, as in feedback error learning (Kawato 1987). The PD combination inverts the joint's own
    closed loop up to its inertia; `lead` makes up for that and for the delay from measuring to acting. Q is a Gaussian
    over time, of zero phase since the whole step is known, which runs on into the steps before and after; it takes from
    W what is too fast for that inverse, and lets W forget what is no longer confirmed.

    A step teaches its own side with `gain` and the other with a share of it: legs differ a little, and with a
    share below 1 both errors go to zero.
    """

    def __init__(self, parameters: MotionParameters, effort_limits: Array) -> None:
        """Make the law for (12,) torque limits [N m]."""
        p = parameters
        self._nodes = nodes_of(p)
        self.shape: tuple[int, ...] = (2, self._nodes, 12)
        self._bound = p.learning_bound * effort_limits
        self._gain = p.learning_gain
        self._share = p.learning_mirror_share
        self._lead = p.learning_lead / p.control_period  # [ticks]
        self._margin, self._smooth = smoother(self._nodes, p.learning_smoothing / p.control_period)

    def playable(self, memory: Array, side: Side) -> Array:
        """Return (N, 12) the waveform in the order of LEG_JOINTS [N m]."""
        return memory[0].copy() if side is Side.LEFT else mirrored(memory[1])

    def torque(self, row: Array, error_rate: Array) -> Array:
        """Return the waveform's row [N m]."""
        return row

    def learn(
        self, memory: Array, side: Side, phases: Array, rates: Array, feedback: Array, neighbour: Array | None
    ) -> None:
        """Add a share of the feedback torque, and smooth."""
        lead = self._lead * float(np.median(np.diff(phases)))  # longer steps pass through their phase more slowly
        needed = self._gain * on_nodes(phases, feedback, self._nodes, lead)
        if side is Side.RIGHT:
            needed = mirrored(needed)
        for taught, share in ((side, 1.0), (side.other, self._share)):
            beside = None if neighbour is None else neighbour[taught.other]
            self._teach(memory[taught], share * needed, beside)

    def _teach(self, waveform: Array, needed: Array, neighbour: Array | None) -> None:
        """Add needed torque to a step's waveform, smooth it across the neighbouring steps, and bound it."""
        margin = self._margin
        raised = waveform + needed
        if neighbour is None:
            before, after = np.repeat(raised[:1], margin, axis=0), np.repeat(raised[-1:], margin, axis=0)
        else:
            # The step on the other foot, in this step's order of legs.
            before, after = mirrored(neighbour[-margin:]), mirrored(neighbour[:margin])
        waveform[:] = np.clip(self._smooth @ np.concatenate([before, raised, after]), -self._bound, self._bound)


def smoother(nodes: int, deviation: float) -> tuple[int, Array]:
    """Return a Gaussian filter as a matrix.

    Args:
        nodes: Rows that come out.
        deviation: Standard deviation in rows, >= 0.

    Returns:
        m, the rows that it needs before and after, and the (nodes, nodes + 2 m) matrix; each row sums to 1.
    """
    margin = max(1, math.ceil(3.0 * deviation))
    offsets = np.arange(-margin, margin + 1)
    kernel = np.exp(-0.5 * (offsets / deviation) ** 2) if deviation > 0.0 else (offsets == 0).astype(float)
    kernel /= kernel.sum()
    matrix = np.zeros((nodes, nodes + 2 * margin))
    for row in range(nodes):
        matrix[row, row : row + 2 * margin + 1] = kernel
    return margin, matrix
