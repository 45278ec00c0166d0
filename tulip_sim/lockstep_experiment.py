"""The identification experiment in lockstep: one robot's world and the experiment, tick by tick."""

from __future__ import annotations

from collections.abc import Callable

from tulip_description.robot_io import JointCommand
from tulip_motion.identification.experiment import Experiment
from tulip_motion.identification.progress import Progress
from tulip_sim.judging import Verdict
from tulip_sim.robot_stack import Listener
from tulip_sim.timing import SLOW_TICKS, TICK
from tulip_sim.world import World

LONGEST = 1200.0  # [s] of simulated time; 40 postures take about 330 s


def run_experiment(
    experiment: Experiment,
    world: World,
    tell: Listener | None = None,
    watch: Callable[[float, Progress], None] | None = None,
    longest: float = LONGEST,
) -> Progress:
    """Let the experiment go to its end; a command acts one tick after its sensors, as in the graph.

    Args:
        experiment: Not begun.
        world: With one robot that stands.
        tell: Told of every message that the graph would carry, and what really is.
        watch: Told simulated time [s] and progress, 50 times in a simulated second.
        longest: After that simulated time it is given up [s].
    """
    tell = tell or (lambda topic, stamp, value: None)
    pending: JointCommand | None = None
    told: Progress | None = None
    tick = 0
    while not experiment.finished and world.stamp < longest * 1e9:
        now, sensors = world.stamp, world.sensors()
        if pending is not None:
            world.apply(pending)
        pending = experiment.tick(sensors)
        tell("sensors", now, sensors)
        tell("legs/joint_command", now, pending)
        if tick % SLOW_TICKS == 0 or experiment.finished:
            progress = experiment.progress
            tell(
                "ground_truth",
                now,
                (world.truth(), Verdict("", (0, 0), experiment.is_limp, int(experiment.is_limp), 0.0)),
            )
            if told is None or _differs(progress, told):
                told = progress
                tell("identification/progress", now, progress)
            if watch is not None:
                watch(now * 1e-9, progress)
        world.advance(TICK)
        tick += 1
    return experiment.progress


def _differs(progress: Progress, told: Progress) -> bool:
    """Return whether there is news but for the time that is left."""
    return (progress.doing, progress.posture, progress.held, progress.left_out, progress.reason) != (
        (told.doing, told.posture, told.held, told.left_out, told.reason)
    )
