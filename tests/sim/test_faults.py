"""Broken sensors of the simulated body, and what the robot then does: in lockstep, with features from the truth."""

from __future__ import annotations

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import JOINTS
from tulip_motion.interface import MotionMode
from tulip_sim.faults import CELLS, SensorFaults, read_fault
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.parameters import WorldParameters
from tulip_sim.perception import PerceptionParameters
from tulip_sim.referee import RefereeParameters
from tulip_sim.scenario import Scenario, make_scenario
from tulip_sim.world import World

SECOND = 1_000_000_000
BREAKS = 4.0  # [s] when the robot walks


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "expected to begin with one of encoder, imu, cell, camera"),
        ("gyro 1", "expected to begin with one of encoder, imu, cell, camera"),
        ("encoder 3", "expected encoder NAME, the name of a joint, and a time in s"),
        ("imu left 3", "expected imu and a time in s"),
        ("imu soon", "expected imu and a time in s >= 0"),
        ("imu -1", "expected imu and a time in s >= 0"),
        ("imu nan", "expected imu and a time in s >= 0"),
        ("cell left 3", "expected a force cell out of left_heel_inner"),
    ],
)
def test_what_describes_no_fault_is_refused(text: str, words: str) -> None:
    with pytest.raises(ValueError, match=words):
        read_fault(text)
    with pytest.raises(ValueError, match=words):
        WorldParameters(faults=(text,))


def test_an_encoder_of_no_joint_is_refused() -> None:
    with pytest.raises(ValueError, match="fault of encoder 'nose'; expected a joint out of left_hip_yaw"):
        SensorFaults(["encoder nose 1"], JOINTS)


@pytest.mark.sim
def test_each_fault_holds_its_reading_from_its_moment_on_and_leaves_the_others() -> None:
    knee, cell = JOINTS.index("left_knee"), CELLS.index("right_heel_outer")
    scenario = Scenario(Pose2D(), (2.0, 0.0))
    broken = World(scenario, WorldParameters(faults=("encoder left_knee 0.1", "imu 0.1", "cell right_heel_outer 0.1")))
    sound = World(scenario, WorldParameters())
    held = None
    for _ in range(50):
        for world in (broken, sound):
            world.advance(4)
        now, was = broken.sensors(), sound.sensors()
        if now.stamp < SECOND // 10:
            np.testing.assert_array_equal(now.joint_positions, was.joint_positions)
            np.testing.assert_array_equal(now.foot_cells, was.foot_cells)
            continue
        held = held or now
        assert now.joint_positions[knee] == held.joint_positions[knee]
        assert now.foot_cells.ravel()[cell] == 0.0
        np.testing.assert_array_equal(now.imu_angular_velocity, held.imu_angular_velocity)
        np.testing.assert_array_equal(now.imu_orientation, held.imu_orientation)
    assert held is not None
    assert np.delete(now.foot_cells.ravel(), cell).min() > 0.0
    assert (now.joint_positions[:3] != held.joint_positions[:3]).any()
    broken.close()
    sound.close()


class Broken:
    """A robot that walks to the ball when a sensor breaks."""

    def __init__(self, fault: str) -> None:
        settings = Settings(
            perception=PerceptionParameters(),
            world=WorldParameters(faults=(f"{fault} {BREAKS}",)),
            referee=RefereeParameters(initial_time=0.5, ready_time=0.5, set_time=0.5),
        )
        self.trial = Lockstep(make_scenario("open", np.random.default_rng(1), load_field()), 1, settings)
        while self.trial.stamp < BREAKS * SECOND:
            self.trial.step()
        assert self.trial.motion.mode is MotionMode.WALK

    def go_on(self, seconds: float) -> set[MotionMode]:
        """Return the modes of motion control from now on."""
        end, modes = self.trial.stamp + round(seconds * SECOND), set()
        while self.trial.stamp < end:
            self.trial.step()
            modes.add(self.trial.motion.mode)
        return modes

    @property
    def efforts(self) -> float:
        """Greatest torque in a leg [N m]."""
        return float(np.abs(self.trial.world.sensors().joint_efforts[:12]).max())


@pytest.mark.sim
@pytest.mark.parametrize(
    ("fault", "words"),
    [("imu", "the IMU is frozen"), ("encoder left_knee", "the encoder of left_knee sticks")],
)
def test_robot_goes_limp_and_stays_so_for_a_sensor_that_it_cannot_walk_without(fault: str, words: str) -> None:
    broken = Broken(fault)
    broken.go_on(0.3)
    assert words in broken.trial.motion.state().reason
    assert broken.go_on(2.0) == {MotionMode.FALLEN}
    assert broken.efforts < 5.0  # damping of what still rolls
    broken.trial.close()


@pytest.mark.sim
def test_robot_walks_on_with_a_dead_force_cell_and_names_it() -> None:
    broken = Broken("cell left_toe_outer")
    assert MotionMode.FALLEN not in broken.go_on(6.0)
    assert any("force cell dead: left toe outer" in note for note in broken.trial.motion.notes)
    assert broken.trial.referee.falls == 0
    broken.trial.close()


@pytest.mark.sim
def test_robot_stands_still_when_pictures_stop_and_the_referee_s_time_goes_on() -> None:
    broken = Broken("camera")
    broken.go_on(4.5)  # 2 s until it is blind, and some steps to stop
    assert broken.go_on(1.0) == {MotionMode.STAND}
    assert broken.trial.doing.endswith("blind > stand")
    assert broken.trial.referee.falls == 0
    broken.trial.close()
