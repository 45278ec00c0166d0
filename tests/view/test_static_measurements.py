"""Static measurements from a recording of the experiment."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_motion.identification.experiment import Experiment, ExperimentParameters
from tulip_motion.identification.experiment_plan import PlanParameters, make_plan
from tulip_motion.identification.passages import Pace
from tulip_ros.errors import BadInputError
from tulip_sim.lockstep_experiment import run_experiment
from tulip_sim.lockstep_recording import LockstepRecording, RecordedPictures
from tulip_sim.scenario import Scenario
from tulip_sim.world import World
from tulip_view.static_measurements import measurements_of

ROBOT = load_robot()
WALK = Path(__file__).parent.parent / "data" / "recordings" / "walk"


@pytest.mark.sim
def test_a_recording_tells_what_the_experiment_measured(tmp_path: Path):
    plan = make_plan(ROBOT, PlanParameters(postures=9, candidates=40))[0]
    experiment = Experiment(ROBOT, [replace(plan, visits=plan.visits[:2])], ExperimentParameters(pace=Pace(0.8)))
    world = World(Scenario(robot=Pose2D(), ball=(0.0, -2.5), poles=False), seed=3)
    recording = LockstepRecording(tmp_path / "experiment", RecordedPictures("none"))
    run_experiment(experiment, world, recording.write)
    recording.close()
    world.close()
    found = measurements_of(recording.path, ROBOT)
    assert [hold for hold, _ in found] == experiment.holds
    assert len(found) == 2
    for (_, read), own in zip(found, experiment.measurements, strict=True):
        assert read.side == own.side
        assert read.cop == pytest.approx(own.cop, abs=1e-7)  # cells are recorded in single precision
        assert read.joint_positions == pytest.approx(own.joint_positions, abs=1e-12)
        assert read.down == pytest.approx(own.down, abs=1e-12)
        assert read.cop_covariance == pytest.approx(own.cop_covariance, rel=1e-3, abs=1e-12)
        assert np.isclose(read.normal_force, own.normal_force)


def test_a_recording_of_something_else_is_refused():
    with pytest.raises(BadInputError, match=r"has no topic /identification/progress"):
        measurements_of(WALK, ROBOT)
