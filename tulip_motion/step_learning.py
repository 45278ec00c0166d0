"""Runs a learning law along the gait: which steps teach, what each situation remembers, and when to stop."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from tulip_motion.interface import Side, Support
from tulip_motion.iterative_learning import AdaptiveLaw, Law, WaveformLaw, nodes_of
from tulip_motion.joint_control import JointGains
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]
Velocity = tuple[float, float, float]
Key = tuple[int, int, int]

SPEED_BIN = 0.2  # [m/s] forward; steps whose speeds round to the same bin are one motion
SIDE_BIN = 0.1  # [m/s]
TURN_BIN = 0.5  # [rad/s]
LEAST_PHASE = 0.75  # a step that ended earlier was another motion
IN_THE_AIR = (0.25, 0.8)  # phase in which the swing foot is in the air; what touches then is a toe that scuffs
PAUSE = 4  # steps without torque after one that scuffed
SLEW_TIME = 0.04  # [s] from zero to the greatest torque: fades in and out, slower than no waveform that passes Q


def key_of(velocity: Velocity, side: Side) -> Key:
    """Return the situation of a step: its velocity in coarse bins, as seen from the stance leg."""
    sign = 1.0 if side is Side.LEFT else -1.0
    return (
        round(velocity[0] / SPEED_BIN),
        round(sign * velocity[1] / SIDE_BIN),
        round(sign * velocity[2] / TURN_BIN),
    )


def mirror_key(key: Key) -> Key:
    """Return the situation of the steps before and after, on the other foot, at the same velocity."""
    return key[0], -key[1], -key[2]


@dataclass
class Situation:
    """What was learned about the steps of one coarse velocity.

    Attributes:
        memory: Of the law.
        baselines: (2,) mean square joint error of the first steps on each side, which go without torque [rad^2]; 0
            before there was one.
    """

    memory: Array
    baselines: Array


class StepLearner:
    """Watches joint errors step by step and gives tau_ILC of eq. (12).

    A step teaches when the one before had the same velocity, it is not the first of a walk, and it ended by landing.
    Steps that start, stop, kick or change speed are other motions, and so are those whose toe scuffs: what the ground
    does to a foot is no error of its torques, and adding it up made the robot limp and fall. After a scuff the
    torque pauses. Above `learning_top_speed`, where toes scuff at every change, nothing is learned or given.

    Each coarse velocity has a memory of its own. Its first step on each foot goes without torque: its error is the
    baseline of that foot. A step with torque that is worse than its baseline by a margin halves the memory instead of
    teaching; after some of them running on one foot, learning switches itself off for good.
    """

    def __init__(self, parameters: MotionParameters, effort_limits: Array) -> None:
        """Make a learner that knows nothing.

        Args:
            parameters: Of motion control; `learning` is "adaptive" or "waveform".
            effort_limits: (12,) torque limits [N m].
        """
        p = self._parameters = parameters
        self._law: Law = AdaptiveLaw(p) if p.learning == "adaptive" else WaveformLaw(p, effort_limits)
        self._nodes = nodes_of(p)
        self._bound = p.learning_bound * effort_limits
        self._slew = self._bound * (p.control_period / SLEW_TIME)
        gains = JointGains(p)
        # (support, K_P or K_D, 12). The torque of an ankle on the ground is the ZMP and belongs to balance: its error
        # does not go away with it, as the reference follows the CoM, and would be added up without end.
        self._gains = np.array([gains.of(support) for support in (Support.DOUBLE, Support.LEFT, Support.RIGHT)])
        for support, ankles in ((0, (4, 5, 10, 11)), (1, (4, 5)), (2, (10, 11))):
            self._gains[support][:, ankles] = 0.0
        self.situations: dict[Key, Situation] = {}
        self.note = ""
        """Why learning was switched off, in words, or ""."""
        self.changed = False
        """Whether something was learned since the last time that this was set to False."""
        self._errors = np.zeros((4 * self._nodes, 2, 12))  # e and e', one row a tick
        self._phases = np.zeros(4 * self._nodes)
        self._supports = np.zeros(4 * self._nodes, dtype=np.intp)
        self._torque = np.zeros(12)
        self._zero = np.zeros(12)
        self._walking = False
        self._worse_steps = [0, 0]
        self.rest()

    @property
    def shape(self) -> tuple[int, ...]:
        """Of the memory of one situation."""
        return self._law.shape

    def rest(self) -> None:
        """Forget the step under way and give no torque: the robot does not walk."""
        if self._walking:
            self._torque[:] = 0.0
            self._walking = False
        self._step = -1
        self._steps_seen = 0
        self._ticks = self._touches = self._pause = 0
        self._key: Key | None = None
        self._key_before: Key | None = None
        self._rows: Array | None = None

    def tick(
        self,
        side: Side,
        support: Support,
        phase: float,
        step: int,
        velocity: Velocity | None,
        touching: bool,
        error: Array,
        error_rate: Array,
    ) -> Array:
        """Return (12,) tau_ILC [N m], order of LEG_JOINTS.

        Args:
            side: Stance side of the step.
            support: Feet that carry now.
            phase: Of the step, 0 to 1.
            step: Number of the step; another one means that a new step has begun.
            velocity: That the step walks with; None if the step is no ordinary one. Looked at when a step begins.
            touching: Whether the foot that is not the stance foot carries weight.
            error: (12,) e, desired minus measured joint angles [rad].
            error_rate: (12,) e' [rad/s].
        """
        self._walking = True
        if step != self._step:
            if self._ticks:
                self._end_step()
            self._begin_step(side, step, velocity)
        k = self._ticks
        if k < len(self._phases):
            row = self._errors[k]
            row[0] = error
            row[1] = error_rate
            self._phases[k] = phase
            self._supports[k] = support
        self._ticks = k + 1
        if touching and IN_THE_AIR[0] < phase < IN_THE_AIR[1]:
            self._touches += 1
        wanted = self._zero
        if self._rows is not None:
            node = min(int(phase * self._nodes), self._nodes - 1)
            wanted = self._law.torque(self._rows[node], error_rate)
        change = np.minimum(np.maximum(wanted - self._torque, -self._slew), self._slew)
        self._torque = np.minimum(np.maximum(self._torque + change, -self._bound), self._bound)
        return self._torque

    def _begin_step(self, side: Side, step: int, velocity: Velocity | None) -> None:
        """Note which step this is, and play what was learned for it, unless it only serves as the measure without."""
        self._side, self._step, self._ticks, self._touches = side, step, 0, 0
        self._steps_seen += 1
        ordinary = velocity is not None and abs(velocity[0]) <= self._parameters.learning_top_speed
        self._key_before, self._key = self._key, key_of(velocity, side) if velocity and ordinary else None
        self._rows = None
        self._pause = max(self._pause - 1, 0)
        if self._key is None or self._steps_seen == 1 or self.note or self._pause:
            return
        situation = self.situations.get(self._key)
        if situation is not None and situation.baselines[side] > 0.0:
            self._rows = self._law.playable(situation.memory, side)

    def _end_step(self) -> None:
        """Let the step that has just ended teach."""
        ticks, key = self._ticks, self._key
        if key is None or self.note or self._steps_seen == 1 or ticks > len(self._phases):
            return
        if self._key_before != mirror_key(key) or self._phases[ticks - 1] < LEAST_PHASE:
            return
        if self._touches > 1:
            # The ground held the foot: not an error of the joints' torques, and nothing to add up.
            self._pause = PAUSE + 1
            return
        errors, rates = self._errors[:ticks, 0], self._errors[:ticks, 1]
        square = float(np.vdot(errors, errors)) / errors.size
        situation = self.situations.get(key)
        if situation is None:
            situation = self.situations[key] = Situation(np.zeros(self._law.shape), np.zeros(2))
        if not situation.baselines[self._side]:
            situation.baselines[self._side] = square
        elif self._rows is not None and self._is_worse(square, float(situation.baselines[self._side])):
            situation.memory *= 0.5
            return
        gains = self._gains[self._supports[:ticks]]
        neighbour = self.situations.get(mirror_key(key))
        self._law.learn(
            situation.memory,
            self._side,
            self._phases[:ticks],
            rates,
            gains[:, 0] * errors + gains[:, 1] * rates,
            None if neighbour is None else neighbour.memory,
        )
        self.changed = True

    def _is_worse(self, square: float, baseline: float) -> bool:
        """Return whether a step with torque was worse than the baseline; after some running, switch learning off."""
        p, side = self._parameters, self._side
        if square <= p.learning_margin**2 * baseline:
            self._worse_steps[side] = 0
            return False
        self._worse_steps[side] += 1
        if self._worse_steps[side] >= p.learning_patience:
            self.note = (
                f"learning ({p.learning}) switched off: joint errors were {1e3 * square**0.5:.1f} mrad RMS, without"
                f" learning {1e3 * baseline**0.5:.1f} mrad, more than {p.learning_margin:g} times that in"
                f" {self._worse_steps[side]} steps running on one foot"
            )
        return True
