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
from tulip_sim.timing import TICK
from tulip_sim.world import World
from tulip_view.recorded_sensors import motion_log_of, sensors_of
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


@pytest.mark.sim
def test_sensors_come_back_as_the_world_gave_them_and_the_motion_log_is_the_longest_part_without_a_gap(tmp_path: Path):
    world = World(Scenario(robot=Pose2D(), ball=(0.0, -2.5), poles=False), seed=3)
    recording = LockstepRecording(tmp_path / "standing", RecordedPictures("none"))
    given = []
    for tick in range(100):
        if tick != 30:  # lost
            given.append(world.sensors())
            recording.write("sensors", world.stamp, given[-1])
        world.advance(TICK)
    recording.close()
    world.close()
    read = list(sensors_of(recording.path))
    assert [each.stamp for each in read] == [each.stamp for each in given]
    assert read[50].joint_positions == pytest.approx(given[50].joint_positions, abs=1e-12)
    assert read[50].foot_cells == pytest.approx(given[50].foot_cells, rel=1e-6)
    assert motion_log_of(recording.path).joint_positions == pytest.approx(
        np.array([each.joint_positions for each in given[30:]]), abs=1e-12
    )


def test_a_recording_without_cells_or_of_no_such_robot_is_refused_by_topic():
    with pytest.raises(BadInputError, match=r"has no messages of /joint_states, /imu, /foot_forces; expected joints"):
        motion_log_of(WALK)
    with pytest.raises(BadInputError, match=r"has no messages of /keeper/joint_states.*the robot keeper"):
        next(sensors_of(WALK, "keeper"))


def test_a_recording_of_something_else_is_refused():
    with pytest.raises(BadInputError, match=r"has no topic /identification/progress"):
        measurements_of(WALK, ROBOT)
