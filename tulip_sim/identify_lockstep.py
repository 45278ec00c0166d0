"""The identification experiment in the simulator, in one process, recorded as the graph would."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.identification.experiment_settings import ExperimentSettings, make_experiment
from tulip_motion.identification.progress import Progress
from tulip_sim.lockstep_experiment import run_experiment
from tulip_sim.lockstep_notes import explain_experiment
from tulip_sim.lockstep_recording import LockstepRecording, RecordedPictures
from tulip_sim.parameters import WorldParameters
from tulip_sim.scenario import Scenario
from tulip_sim.secret_body import hidden_truth
from tulip_sim.world import World

ALONE = Scenario(robot=Pose2D(), ball=(0.0, -2.5), poles=False)
"""The robot with nothing near it."""


def run_lockstep(
    settings: ExperimentSettings,
    seed: int,
    record: Path,
    show: Callable[[Progress], None],
    secret: int | None = None,
) -> Progress:
    """Do the experiment.

    Args:
        settings: Of the experiment.
        seed: Of all noise.
        record: New folder for the recording.
        show: Told the progress.
        secret: Seed of the body that the simulated robot has; None for that of robot.yaml.

    Raises:
        BadInputError: if the recording cannot be written.
        ValueError: if the settings fit no experiment.
    """
    experiment = make_experiment(settings)
    robot = load_robot()
    body, parameters = hidden_truth(robot, WorldParameters(), secret)
    recording = LockstepRecording(record, RecordedPictures("none"))
    world = World(ALONE, parameters, seed, robot=robot, true_body=body)
    try:
        explain_experiment(recording.notebook, seed, settings, parameters, secret)
        return run_experiment(experiment, world, recording.write, lambda now, progress: show(progress))
    finally:
        recording.close()
        world.close()
