"""Runs a body behind the driver's guard, as the node does, and writes down all that passes between them."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from tulip_description.robot import HEAD_JOINTS, LEG_JOINTS, Robot
from tulip_description.robot_io import JointCommand, Sensors
from tulip_driver.body_clock import host_clock
from tulip_driver.check.rows import Judgement, Row
from tulip_driver.contract import PERIOD, Body
from tulip_driver.guard import GuardParameters
from tulip_driver.loading import flag
from tulip_driver.loop import BodyLoop
from tulip_motion.parameters import MotionParameters

Array = NDArray[np.float64]
GAINS = MotionParameters().swing_stiffness, MotionParameters().swing_damping
"""Of each joint of a leg from the hip down [N m/rad], [N m s/rad]: those of legs in the air, as the robot hangs."""
HEAD_GAINS = 20.0, 0.3  # [N m/rad], [N m s/rad]
EASE = 1.0  # [s] for a way of any length
STALL, TRIES = 0.03, 6  # [s] between two readings that disturb a check, and how often it is made at most
SILENCE = 1.0  # [s] of wall-clock time without a new reading after which a body is silent


class SilentError(Exception):
    """No new reading comes any more."""


class Probe(Body):
    """Stands before a body and writes down what it is told.

    Attributes:
        told: Time of the driver [ns] and command of each exchange since they were last cleared.
        muted: Whether the body is told nothing new, so that it does not move.
        went_back: Readings whose stamp was older than the one before.
    """

    def __init__(self, body: Body) -> None:
        self._body = body
        self.now: Callable[[], int] = lambda: 0  # set by the rig
        self.told: list[tuple[int, JointCommand]] = []
        self.muted = False
        self.went_back = 0
        self._stamp: int | None = None

    def start(self) -> None:
        """Start the body."""
        self._stamp = None
        self._body.start()

    def exchange(self, command: JointCommand | None) -> Sensors:
        """Write the command down and hand it on."""
        if command is not None:
            self.told.append((self.now(), command))
        reading = self._body.exchange(None if self.muted else command)
        self.went_back += self._stamp is not None and reading.stamp < self._stamp
        self._stamp = reading.stamp
        return reading

    def stop(self) -> None:
        """Stop the body."""
        self._body.stop()


class Rig:
    """A body in its loop, in real time; a simulated one as fast as it can.

    Args:
        body: Under test.
        robot: What it should be like.
        parameters: Of the guard.

    Attributes:
        loop: The driver's part.
        readings: All new ones since they were last cleared.
        arrivals: When each of them came [ns], in the driver's time.
        late: How much later than asked for the computer woke up before each exchange [s].
    """

    def __init__(self, body: Body, robot: Robot, parameters: GuardParameters) -> None:
        self.body, self.robot, self.parameters = body, robot, parameters
        self.probe = Probe(body)
        clock = None if flag(body, "simulated") else host_clock
        self.loop = BodyLoop(self.probe, robot, parameters, clock)
        self.probe.now = lambda: self.loop.told_at
        self._waits = not flag(body, "own_clock") and not flag(body, "simulated")
        self._due = self._heard = time.monotonic()
        self._longest = 0.0  # [s] of wall-clock time between two readings
        self._sequence = 0
        self.readings: list[Sensors] = []
        self.arrivals: list[int] = []
        self.late: list[float] = []
        self._groups = [names for names in (LEG_JOINTS, HEAD_JOINTS) if set(names) <= set(robot.joint_names)]
        self._index = {name: index for index, name in enumerate(robot.joint_names)}

    def tick(self) -> Sensors | None:
        """Exchange once, when it is time.

        Raises:
            SilentError: if the body has been silent for too long.
            BodyError: if it is lost.
        """
        if self._waits:
            time.sleep(max(self._due - time.monotonic(), 0.0))
            self.late.append(time.monotonic() - self._due)
            self._due = max(self._due + PERIOD * 1e-9, time.monotonic())
        reading = self.loop.tick()
        now = time.monotonic()
        if reading is not None:
            self.readings.append(reading)
            self.arrivals.append(self.loop.now)
            self._longest = max(self._longest, now - self._heard)
            self._heard = now
        elif now - self._heard > SILENCE or (flag(self.body, "simulated") and not flag(self.body, "moves")):
            raise SilentError
        return reading

    def begin(self) -> None:
        """Forget what was written down."""
        self.readings.clear()
        self.arrivals.clear()
        self.late.clear()
        self.probe.told.clear()
        self._heard = time.monotonic()

    def order(self, position: Array, effort: Array | None = None, **changes: Array) -> list[JointCommand]:
        """Return commands that hold a posture, one for each group of joints, to the newest reading.

        Args:
            position: (n,) [rad].
            effort: (n,) feedforward [N m]; none by default.
            changes: (n,) other values of a command, as in stiffness.
        """
        assert self.loop.sensors is not None
        self._sequence += 1
        heads = len(self._index) - len(LEG_JOINTS)
        stiffness, damping = ([*leg * 2, *[head] * heads] for leg, head in zip(GAINS, HEAD_GAINS, strict=True))
        values = {
            "position": position,
            "velocity": np.zeros(len(position)),
            "effort": np.zeros(len(position)) if effort is None else effort,
            "stiffness": np.array(stiffness),
            "damping": np.array(damping),
            **changes,
        }
        joints = [np.array([self._index[name] for name in names]) for names in self._groups]
        return [
            JointCommand(
                self._sequence, self.loop.sensors.stamp, names, **{name: value[own] for name, value in values.items()}
            )
            for names, own in zip(self._groups, joints, strict=True)
        ]

    def command(self, position: Array, effort: Array | None = None, **changes: Array) -> str:
        """Give such commands to the driver; return "" or why one was refused."""
        return "; ".join(filter(None, map(self.loop.accept, self.order(position, effort, **changes))))

    def hold(self, seconds: float, path: Callable[[float], Array], effort: Array | None = None) -> list[Sensors]:
        """Follow a path for a while and return the readings.

        Args:
            seconds: How long, in the driver's time.
            path: (n,) wanted positions [rad] by the time since the beginning [s].
            effort: (n,) feedforward [N m].
        """
        self.begin()
        begin = self.loop.now
        while (passed := (self.loop.now - begin) * 1e-9) < seconds:
            self.command(path(passed), effort)
            self.tick()
        return list(self.readings)

    def ease(self, position: Array) -> None:
        """Go from where the joints are to (n,) positions [rad], without haste."""
        assert self.loop.sensors is not None
        start = self.loop.sensors.joint_positions
        self.hold(EASE, lambda passed: start + (position - start) * smooth(passed / EASE))

    def wait(self, seconds: float) -> list[Sensors]:
        """Let time pass without commands and return the readings."""
        self.begin()
        begin = self.loop.now
        while (self.loop.now - begin) * 1e-9 < seconds:
            self.tick()
        return list(self.readings)

    def undisturbed(self, check: Callable[[], Iterable[Row]]) -> list[Row]:
        """Return what a check says; one that fails while readings stopped for a moment is made again.

        A computer with other things to do holds up both ends; a driver is not to blame for that.
        """
        for _ in range(TRIES):
            self._longest = 0.0
            rows = list(check())
            if self._longest < STALL or all(row.judgement is not Judgement.FAIL for row in rows):
                break
        return rows

    def wait_for_reading(self) -> list[Sensors]:
        """Go on until the first reading comes, and return it.

        Raises:
            SilentError: if none comes.
        """
        while not self.readings:
            self.tick()
        return list(self.readings)


def smooth(share: float) -> float:
    """Go from 0 to 1 without a jerk, as the share of time passes from 0 to 1."""
    return float(0.5 - 0.5 * np.cos(np.pi * min(max(share, 0.0), 1.0)))


def whole_steps(readings: Sequence[Sensors]) -> tuple[Array, NDArray[np.bool_]]:
    """Return (k - 1,) times between readings [s], and whether none is missing in between."""
    steps = np.diff([reading.stamp for reading in readings])
    return steps * 1e-9, steps < 1.5 * PERIOD
