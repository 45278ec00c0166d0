"""The identification experiment, rehearsed: postures on one foot, then on the other."""

from __future__ import annotations

from tulip_description.robot_io import Sensors
from tulip_motion.identification.experiment_settings import ExperimentSettings, make_experiment
from tulip_motion.identification.progress import Progress
from tulip_sim.identify_lockstep import ALONE
from tulip_sim.lockstep_experiment import run_experiment
from tulip_sim.parameters import WorldParameters
from tulip_sim.rehearsal.present import Present
from tulip_sim.rehearsal.watch import Course, Watch
from tulip_sim.world import World


def play_experiment(settings: ExperimentSettings, present: Present, seed: int) -> Course:
    """Do the experiment once, to its end or until the robot falls.

    Args:
        settings: Of the experiment.
        present: How the robot stands.
        seed: Of the simulated robot's masses, friction and sensor errors.

    Raises:
        ValueError: if the settings fit no experiment, or the robot does not stand on both feet.
    """
    world = World(
        ALONE,
        WorldParameters(),
        seed,
        joint_positions=present.joint_positions,
        true_body=settings.robot,
        tilt=present.tilt,
    )
    watch = Watch(world, seed)

    def listen(topic: str, stamp: int, value: object) -> None:
        if isinstance(value, Sensors):
            watch.look(value)

    def follow(now: float, progress: Progress) -> None:
        words = f"{progress.doing} {progress.posture + 1}" if progress.posture >= 0 else str(progress.doing)
        if not watch.beginnings or watch.beginnings[-1][1] != words:
            watch.begin(words)

    try:
        experiment = make_experiment(settings)
        end = run_experiment(experiment, world, listen, follow)
    finally:
        world.close()
    if end.reason and not experiment.is_limp:
        watch.refusals.append(f"aborted: {end.reason}")
    if end.left_out:
        watch.refusals.append(f"not held still: postures {', '.join(str(number + 1) for number in end.left_out)}")
    return watch.course(end.reason if experiment.is_limp else "")
