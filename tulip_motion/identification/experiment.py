"""The experiment of section 2: hold static postures on one foot, then on the other, and average the sensors.

A state machine like `tulip_motion.motion.Motion`: each tick turns one reading of the sensors into one command, here for
all joints, the head's too. Whatever `Watch` finds, and `abort`, makes the robot turn round on the road that it is on,
go home over the plan's roads, put the foot down and stand; a robot that falls, or is told so, goes limp.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from tulip_description.model import Side as SideName
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_motion.identification.averaging import AveragingParameters, HoldAverage, StillnessGate
from tulip_motion.identification.experiment_plan import FootPlan
from tulip_motion.identification.experiment_safety import SafetyParameters, Watch
from tulip_motion.identification.one_foot_control import OneFootControl, OneFootParameters
from tulip_motion.identification.passages import ALONE, BOTH, STANDING, Doing, Pace, Passage, passages
from tulip_motion.identification.posture_roads import Road
from tulip_motion.identification.progress import Hold, Progress
from tulip_motion.identification.static_measurement import StaticMeasurement
from tulip_motion.interface import Side
from tulip_motion.mirrored_step import quintic

Array = NDArray[np.float64]
USUAL_SETTLING = 3.0  # [s] for the time that is left
TURN_ROUND = 4.0  # [1/s] from full speed to a stop in 0.25 s


@dataclass(frozen=True)
class ExperimentParameters:
    """Speeds, times and limits."""

    stand_time: float = 1.5  # [s] at the start, from how the robot stands to the standing posture
    unload_cop: float = 0.010  # [m] of the CoP from its aim at most before the foot lifts
    settle_cop: float = 0.0015  # [m] before averaging begins
    settle_patience: float = 4.0  # [s] for that; a robot that is still is then measured with its CoP where it is
    pace: Pace = field(default_factory=Pace)
    averaging: AveragingParameters = field(default_factory=AveragingParameters)
    balance: OneFootParameters = field(default_factory=OneFootParameters)
    safety: SafetyParameters = field(default_factory=SafetyParameters)


class Experiment:
    """Drives the robot through the postures of a plan and collects what the sensors tell."""

    def __init__(self, robot: Robot, plans: Sequence[FootPlan], parameters: ExperimentParameters | None = None) -> None:
        """Begin; the robot stands on both feet.

        Args:
            robot: As it is believed to be.
            plans: One a stance foot, in their order.
            parameters: Speeds, times and limits.
        """
        p = self._parameters = parameters or ExperimentParameters()
        self._robot, self._period = robot, p.balance.control_period
        self._control = OneFootControl(robot, p.balance)
        self._watch = Watch(robot, p.safety, self._period)
        self._postures = sum(len(plan.visits) for plan in plans)
        self._ahead: deque[Passage] = deque(passages(plans, p.pace))
        self._now: Passage = STANDING
        self._elapsed = 0.0  # [s] on the present passage
        self._speed = 1.0  # of that time: negative on the way back along a road
        self._turning_round = False
        self._here: Array | None = None  # where the last road has led
        self._gate = StillnessGate(p.averaging, self._period)
        self._average: HoldAverage | None = None
        self._averaging_since = 0
        self._left_out: list[int] = []
        self.holds: list[Hold] = []
        """Those that ended well, in their order."""
        self.measurements: list[StaticMeasurement] = []
        """One a hold."""
        self.reason = ""
        """Why the experiment was aborted, or ""."""
        self.is_limp = False
        """Whether the legs are without stiffness, and stay so: the robot falls, or somebody said so."""

    @property
    def finished(self) -> bool:
        """Whether the robot stands on both feet again, or lies, and nothing is left to do."""
        return self.is_limp or (self._here is not None and self._now is STANDING and not self._ahead)

    @property
    def progress(self) -> Progress:
        """How far it has come."""
        left = sum(self._usual_time(passage) for passage in (self._now, *self._ahead)) - self._elapsed
        return Progress(
            Doing.LIMP if self.is_limp else self._now.doing,
            self._now.posture,
            self._postures,
            len(self.holds),
            tuple(self._left_out),
            0.0 if self.finished else max(0.0, left),
            self.reason,
            self.holds[-1] if self.holds else None,
            self.finished,
        )

    def abort(self, reason: str) -> None:
        """Go home, put the foot down and stand.

        Args:
            reason: In words, for the report.
        """
        if self.reason or self.finished:
            return
        self.reason = reason
        if self._now.way_back and self._now.road is not None:
            self._turning_round = True
        elif self._now.way_back:
            self._go_back()
        else:  # it is on its way to both feet already
            kept = []
            while self._ahead and self._now.doing not in (Doing.STAND, Doing.RETURN):
                kept.append(self._ahead.popleft())
                if kept[-1].doing is Doing.RETURN:
                    break
            self._ahead = deque((*kept, STANDING))

    def go_limp(self, reason: str) -> None:
        """Let the legs go, from the next command on and for good; the head stays up.

        Args:
            reason: In words, for the report.
        """
        if not self.is_limp:
            self.is_limp, self.reason = True, self.reason or reason

    def tick(self, sensors: Sensors) -> JointCommand:
        """Return the command for all joints that answers one reading of the sensors."""
        if self._here is None:
            self._start(sensors)
        now, control = self._now, self._control
        control.body.update(sensors, now.stance)
        if self._watch.is_falling(sensors, control.body):
            self.go_limp("the robot falls")
        if self.is_limp:
            return control.limp(sensors)
        share, position, velocity = self._reference()
        command = control.command(sensors, now.stance, share, position, velocity)
        fault = self._watch.fault(sensors, control.body, now, command.position)
        if fault:
            self.abort(fault)
        if share == ALONE and self._average is None:
            control.correct(now.stance)
        else:
            control.rest()
        if self._now.doing is Doing.HOLD:
            self._hold(sensors)
        self._pass_time()
        return command

    def _start(self, sensors: Sensors) -> None:
        """Go from how the robot stands to the standing posture first."""
        standing = standing_posture(self._robot).joint_positions
        self._here = standing
        road = Road(np.linspace(sensors.joint_positions, standing, 5))
        self._now = Passage(Doing.STAND, Side.LEFT, road, self._parameters.stand_time, (BOTH, BOTH))

    def _reference(self) -> tuple[float, Array, Array]:
        """Return the stance foot's share of the weight, and where the joints shall be (n,) [rad], [rad/s]."""
        now = self._now
        progress, rate, _ = quintic(self._elapsed, max(now.time, self._period))
        share = now.shares[0] + progress * (now.shares[1] - now.shares[0])
        if now.road is None:
            assert self._here is not None
            return share, self._here, np.zeros(len(self._here))
        return share, now.road.position(progress), self._speed * rate * now.road.rate(progress)

    def _hold(self, sensors: Sensors) -> None:
        """Average once the robot is still, anew if it has moved meanwhile, and go on."""
        p, now = self._parameters, self._now
        side: SideName = "left" if now.stance is Side.LEFT else "right"
        still = self._gate.is_still(sensors, self._control.body.cop)
        if self._average is None:
            centred = np.abs(self._gate.cop - self._control.aims[now.stance]).max() < p.settle_cop
            if still and (centred or self._elapsed > p.settle_patience):
                self._average, self._averaging_since = HoldAverage(self._robot, side), sensors.stamp
            elif self._elapsed >= now.time:
                self._left_out.append(now.posture)
                self._begin_next()
        elif not still:
            self._average = None
        if self._average is not None:
            self._average.add(sensors)
            if len(self._average) * self._period >= p.averaging.duration:
                self.measurements.append(self._average.measurement())
                self.holds.append(Hold(now.posture, side, self._averaging_since, sensors.stamp))
                self._begin_next()

    def _pass_time(self) -> None:
        """Go on along the present passage, and over to the next one at its end."""
        now, control = self._now, self._control
        if self._turning_round:
            self._speed = max(-1.0, self._speed - TURN_ROUND * self._period)
        self._elapsed += self._speed * self._period
        if self._elapsed <= 0.0 and self._turning_round:
            self._go_back()
        elif now.doing is Doing.UNLOAD:
            error = float(np.abs(control.aims[now.stance] - control.body.cop).max())
            if error < self._parameters.unload_cop:
                self._begin_next()
            elif self._elapsed >= now.time:
                self.abort(f"the weight does not come over the {now.stance.name.lower()} foot")
        elif now.doing is not Doing.HOLD and self._elapsed >= now.time and self._ahead:
            self._begin_next()

    def _go_back(self) -> None:
        """Begin the way back from where the present passage began."""
        self._ahead = deque(self._now.way_back)
        self._elapsed = 0.0
        self._begin_next()

    def _begin_next(self) -> None:
        """Go over to the next passage, from where the last one has led."""
        now = self._now
        if now.road is not None:
            self._here = now.road.position(quintic(self._elapsed, now.time)[0])
        self._now = self._ahead.popleft()
        self._elapsed, self._speed, self._turning_round, self._average = 0.0, 1.0, False, None
        self._gate = StillnessGate(self._parameters.averaging, self._period)

    @staticmethod
    def _usual_time(passage: Passage) -> float:
        return USUAL_SETTLING if passage.doing in (Doing.HOLD, Doing.UNLOAD) else passage.time
