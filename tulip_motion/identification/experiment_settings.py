"""Everything that the experiment can be told, and the experiment made from it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from tulip_description.robot import Robot, load_robot
from tulip_motion.identification.experiment import Experiment, ExperimentParameters
from tulip_motion.identification.experiment_plan import PlanParameters, make_plan
from tulip_motion.identification.static_postures import PostureParameters


@dataclass(frozen=True)
class ExperimentSettings:
    """Parameters of node identify."""

    body_file: str = ""  # the body that the robot is believed to have; "" is that of robot.yaml
    plan: PlanParameters = field(default_factory=PlanParameters)
    posture: PostureParameters = field(default_factory=PostureParameters)
    experiment: ExperimentParameters = field(default_factory=ExperimentParameters)
    at_once: bool = True  # begin by itself; else stand until service identification/begin is called

    @property
    def robot(self) -> Robot:
        """As it is believed to be.

        Raises:
            ValueError: if the body file cannot be used.
        """
        return load_robot(body=Path(self.body_file)) if self.body_file else load_robot()


def make_experiment(settings: ExperimentSettings, advance: Callable[[], None] = lambda: None) -> Experiment:
    """Plan the experiment and return it.

    Args:
        settings: What to plan.
        advance: Told after each foot; planning takes some seconds.

    Raises:
        ValueError: if the settings fit no such experiment.
    """
    robot = settings.robot
    return Experiment(robot, make_plan(robot, settings.plan, settings.posture, advance), settings.experiment)
