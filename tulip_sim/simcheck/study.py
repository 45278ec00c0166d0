"""The studies of the validation: each an experiment, what it is compared with, its bounds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

from tulip_description.materials import GRAVITY
from tulip_sim.simcheck import checks, differences
from tulip_sim.simcheck.balance import Balance, balance
from tulip_sim.simcheck.checks import Check
from tulip_sim.simcheck.compliant_ground import SOFT, STIFF
from tulip_sim.simcheck.differences import Difference
from tulip_sim.simcheck.drop import drop
from tulip_sim.simcheck.engine import Recording
from tulip_sim.simcheck.experiment import Experiment
from tulip_sim.simcheck.flight import flight
from tulip_sim.simcheck.landing import landing
from tulip_sim.simcheck.standing_push import PUSHES, standing_push
from tulip_sim.simcheck.swing import swing


@dataclass(frozen=True)
class Run:
    """A recording and its balance."""

    recording: Recording
    balance: Balance


@dataclass(frozen=True)
class Study:
    """An experiment and what is asked of it.

    Attributes:
        experiment: What is done.
        references: Other ways to compute it, by name. What is asked is asked of the difference from the first.
        check: Returns the balances of a run with so many steps a millisecond, and their bounds.
        compare: Returns by how much a run differs from a reference.
    """

    experiment: Experiment
    references: Mapping[str, Callable[[], Recording]]
    check: Callable[[Run, int], list[Check]]
    compare: Callable[[Run, Run], list[Difference]]

    def simulate(self, substeps: int = 1) -> Run:
        """Carry it out in the simulator, with so many steps of physics a millisecond."""
        return self._with_balance(self.experiment.simulate(substeps))

    def refer(self, name: str) -> Run:
        """Carry it out by a reference."""
        return self._with_balance(self.references[name]())

    def _with_balance(self, recording: Recording) -> Run:
        return Run(recording, balance(self.experiment.robot, recording))


def _swing(driven: bool) -> Study:
    experiment = swing(driven)
    return Study(
        experiment,
        {"forward dynamics": experiment.compute},
        lambda run, substeps: checks.in_air(run.balance, substeps),
        lambda run, other: [differences.angles(run.recording, other.recording)],
    )


def _flight() -> Study:
    experiment = flight()
    return Study(
        experiment,
        {"forward dynamics": experiment.compute},
        lambda run, substeps: [
            *checks.in_air(run.balance, substeps),
            *checks.momenta(run.recording, run.balance, experiment.robot.mass),
        ],
        lambda run, other: [
            differences.angles(run.recording, other.recording),
            differences.attitude(run.recording, other.recording),
            differences.com(run.balance, other.balance),
        ],
    )


def _on_ground(
    experiment: Experiment,
    speed: float,
    references: Mapping[str, Callable[[], Recording]],
    compare: Callable[[Run, Run], list[Difference]],
) -> Study:
    mass = experiment.robot.mass

    def check(run: Run, substeps: int) -> list[Check]:
        return [
            *checks.on_ground(run.recording, run.balance, mass, speed, substeps),
            *checks.momenta(run.recording, run.balance, mass),
        ]

    return Study(experiment, references, check, compare)


def _springs(experiment: Experiment) -> dict[str, Callable[[], Recording]]:
    return {"stiff ground": partial(experiment.compute, STIFF), "soft ground": partial(experiment.compute, SOFT)}


def _body(run: Run, other: Run) -> list[Difference]:
    return [
        differences.angles(run.recording, other.recording),
        differences.attitude(run.recording, other.recording),
        differences.com(run.balance, other.balance),
        differences.cop(run.recording, other.recording),
        differences.impulse(run.recording, other.recording),
    ]


def _drop(height: float) -> Study:
    experiment = drop(height)
    return _on_ground(experiment, math.sqrt(2.0 * GRAVITY * height), _springs(experiment), _body)


def _push(direction: str) -> Study:
    experiment = standing_push(direction)
    return _on_ground(experiment, 0.0, _springs(experiment), _body)


def _landing(speed: float, driven: bool) -> Study:
    experiment = landing(speed, driven)

    def compare(run: Run, other: Run) -> list[Difference]:
        own, their = run.recording, other.recording
        return [
            *(differences.impulse(own, their, milliseconds) for milliseconds in (5, 20)),
            *(differences.velocities(own, their, milliseconds) for milliseconds in (5, 20)),
        ]

    references: dict[str, Callable[[], Recording]] = {
        "rigid impact": experiment.collide,
        "stiff ground": partial(experiment.compute, STIFF),
    }
    return _on_ground(experiment, speed, references, compare)


STUDIES: dict[str, Callable[[], Study]] = {
    "leg swings, loose": partial(_swing, driven=False),
    "leg swings, driven": partial(_swing, driven=True),
    "flight": _flight,
    **{f"drop from {100 * height:.0f} cm": partial(_drop, height) for height in (0.01, 0.02, 0.03)},
    **{f"standing, pushed {direction}": partial(_push, direction) for direction in PUSHES},
    **{f"landing at {speed} m/s, loose": partial(_landing, speed, driven=False) for speed in (0.1, 0.3, 0.5)},
    **{f"landing at {speed} m/s, driven": partial(_landing, speed, driven=True) for speed in (0.1, 0.3, 0.5)},
}
"""All studies by name."""
