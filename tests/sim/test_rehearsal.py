"""Rehearsals: what may be played, how the robot stands, what is measured, and what is beyond the limits."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import LEG_JOINTS, load_robot
from tulip_description.robot_io import Sensors
from tulip_motion.identification.experiment_plan import PlanParameters
from tulip_motion.identification.experiment_settings import ExperimentSettings
from tulip_motion.interface import KickKind, Side
from tulip_motion.parameters import MotionParameters
from tulip_sim.parameters import WorldParameters
from tulip_sim.rehearsal import experiment
from tulip_sim.rehearsal.motions import Part, everything, parse
from tulip_sim.rehearsal.picture import draw
from tulip_sim.rehearsal.play import play
from tulip_sim.rehearsal.present import present_of, standing
from tulip_sim.rehearsal.verdict import Limits, figures, reasons
from tulip_sim.rehearsal.watch import Course, SupportPolygon
from tulip_sim.scenario import Scenario
from tulip_sim.world import World

ROBOT = load_robot()
PARAMETERS = MotionParameters()
POSTURE = standing_posture(ROBOT).joint_positions
ANKLES = [LEG_JOINTS.index(f"{side}_ankle_pitch") for side in ("left", "right")]
LEAN = 0.06  # [rad]


def leaning() -> np.ndarray:
    """Return the posture of a robot that stands with its trunk and legs leaning forward, soles flat."""
    joints = POSTURE.copy()
    joints[ANKLES] -= LEAN
    return joints


def reading(joints: np.ndarray, turn: Rotation, **changes: np.ndarray) -> Sensors:
    n = len(ROBOT.joint_names)
    still = Sensors(
        *(0, joints, np.zeros(n), np.zeros(n), turn.as_quat()),
        *(np.zeros(3), np.array([0.0, 0.0, 9.81]), np.full((2, 4), 28.0)),
    )
    return replace(still, **changes)


def test_feet_keep_clear_of_each_other_on_the_fastest_curve() -> None:
    course = play(parse(["walk", "0.29", "0", "1.16", "5"], PARAMETERS), PARAMETERS, standing(ROBOT), seed=1)
    assert not course.fall
    assert course.clearance[0] > Limits().clearance  # on their straight ways they would be 10 mm within each other


def test_motions_follow_each_other_as_they_are_written() -> None:
    walk, stand, kick, aside = parse(
        ["walk", "-0.2", "0", "0.5", "stand", "2", "kick", "left", "2.5", "sidekick", "right"], PARAMETERS, 7.0
    )
    assert walk == Part("walk -0.2 0 0.5", 7.0, (-0.2, 0.0, 0.5)) and stand == Part("stand", 2.0)
    assert kick.kick is not None and (kick.kick.side, kick.kick.speed) == (Side.LEFT, 2.5)
    assert aside.kick is not None and (aside.kick.kind, aside.kick.side) == (KickKind.SIDE, Side.RIGHT)
    assert aside.kick.direction == pytest.approx(-math.pi / 2)  # to the right


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        ("jump 3", "no motion 'jump'"),
        ("walk 0.3", "incomplete; expected walk FORWARD LEFT TURN"),
        ("0.3 0 0", "one after the other"),
        ("walk 0.7 0 0", "the walk can do -0.35 to 0.65 m/s"),
        ("walk 0 -0.4 0", "to the left is -0.4"),
        ("walk 0 0 inf", "finite"),
        ("walk 0 0 0 1000", "at most 600"),
        ("stand -1", "above 0"),
        ("kick 3", "is no kick"),
        ("kick left 9", "at most 3.5"),
    ],
)
def test_motions_that_cannot_be_are_refused_in_words(words: str, complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        parse(words.split(), PARAMETERS)


@pytest.mark.parametrize("gait", ["dcm", "paper"])
def test_everything_is_within_what_the_walk_can_do(gait: str) -> None:
    parameters = MotionParameters(gait=gait)
    walks = [part.velocity for part in everything(parameters) if part.velocity is not None]
    assert len(walks) >= 4 and len(set(walks)) == len(walks)
    for walk in walks:
        parse(["walk", *map(str, walk)], parameters)


def test_the_heading_is_left_out_of_how_the_robot_stands_and_its_tilt_kept() -> None:
    turn = Rotation.from_euler("z", 2.0) * Rotation.from_euler("y", LEAN)
    present = present_of(ROBOT, [reading(leaning(), turn)] * 3)
    assert present.tilt == pytest.approx((0.0, math.sin(LEAN / 2), 0.0, math.cos(LEAN / 2)), abs=1e-9)
    np.testing.assert_allclose(present.joint_positions, leaning())
    assert present.note == ""


def test_a_robot_that_hangs_is_told_to_carry_nothing() -> None:
    hanging = reading(POSTURE, Rotation.identity(), foot_cells=np.zeros((2, 4)))
    assert "carries nothing" in present_of(ROBOT, [hanging]).note


def moving(joint: str) -> np.ndarray:
    speeds = np.zeros(len(ROBOT.joint_names))
    speeds[ROBOT.joint_names.index(joint)] = 1.0
    return speeds


def test_a_head_may_look_round_while_the_robot_stands() -> None:
    present_of(ROBOT, [reading(POSTURE, Rotation.identity(), joint_velocities=moving("head_pan"))])


@pytest.mark.parametrize(
    ("readings", "complaint"),
    [
        ([], "no reading"),
        ([reading(POSTURE, Rotation.from_euler("y", 1.4))], "tilted by 80 deg.*set it upright"),
        ([reading(POSTURE, Rotation.identity(), joint_velocities=moving("left_knee"))], "left_knee turns at 1.0"),
        ([reading(POSTURE + 3.0, Rotation.identity())], "look at its zero"),
        ([reading(POSTURE * math.nan, Rotation.identity())], "not finite"),
        ([reading(POSTURE, Rotation.identity(), imu_orientation=np.zeros(4))], "no quaternion"),
    ],
)
def test_a_robot_that_does_not_stand_still_is_refused(readings: list[Sensors], complaint: str) -> None:
    with pytest.raises(ValueError, match=complaint):
        present_of(ROBOT, readings)


UPRIGHT = np.array([0.0, 0.0, 0.0, 1.0])
FOOT = ROBOT.feet[0]
LENGTH, WIDTH = FOOT.x[1] - FOOT.x[0], FOOT.y[1] - FOOT.y[0]
MIDDLE = (0.5 * (FOOT.x[0] + FOOT.x[1]), 0.5 * (FOOT.y[0] + FOOT.y[1]))


def test_the_margin_is_to_the_nearest_edge_of_what_carries() -> None:
    margin = SupportPolygon(ROBOT).margin
    weight = [(*MIDDLE, 225.0)]
    half = [(*MIDDLE, 112.5)]
    assert margin(UPRIGHT, POSTURE, (weight, [])) == pytest.approx(WIDTH / 2)  # 0.15 m wide, 0.21 m long
    assert margin(UPRIGHT, POSTURE, ([(FOOT.x[1], 0.0, 225.0)], [])) == pytest.approx(0.0, abs=1e-12)
    assert margin(UPRIGHT, POSTURE, (half, half)) == pytest.approx(LENGTH / 2)  # the soles' hull is 0.39 m wide
    assert margin(UPRIGHT, POSTURE, (weight, [(*MIDDLE, 1.0)])) == pytest.approx(WIDTH / 2)  # hardly touches
    assert math.isnan(margin(UPRIGHT, POSTURE, ([], [])))


def test_the_margin_does_not_depend_on_the_heading() -> None:
    contacts = ([(0.1, 0.02, 100.0), (-0.03, 0.0, 50.0)], [(0.0, 0.0, 80.0)])
    turned = np.array([0.0, 0.0, math.sin(0.5), math.cos(0.5)])
    margin = SupportPolygon(ROBOT).margin
    assert margin(turned, POSTURE, contacts) == pytest.approx(margin(UPRIGHT, POSTURE, contacts))


def course(**changes: object) -> Course:
    """Return a quiet second."""
    n, ticks = len(ROBOT.joint_names), 250
    quiet = Course(
        seed=1,
        times=np.arange(ticks) * 0.004,
        torques=np.full((ticks, n), 0.3),
        speeds=np.full((ticks, n), -0.2),
        margins=np.full(ticks, 0.05),
        tilts=np.zeros(ticks),
        clearance=(0.04, "left_thigh and left_arm"),
        beginnings=[(0.0, "stand"), (0.5, "walk 0.3 0 0")],
    )
    return replace(quiet, **changes)  # type: ignore[arg-type]


def with_some(values: np.ndarray, rows: int, value: float) -> np.ndarray:
    """Return values of which some of one joint (or of the only column) are others."""
    changed = values.copy()
    changed.reshape(len(values), -1)[:rows, min(3, changed.reshape(len(values), -1).shape[1] - 1)] = value
    return changed


@pytest.mark.parametrize(
    ("second", "complaint"),
    [
        (course(fall="the torso leans"), "falls (seed 1) after 1.0 s, in walk 0.3 0 0: the torso leans"),
        (course(torques=with_some(course().torques, 5, -1.0)), "left_knee gives all its torque for 2.0% of the time"),
        (course(speeds=with_some(course().speeds, 1, 0.95)), "left_knee turns at 95% of its greatest speed"),
        (course(margins=with_some(course().margins, 50, 0.0)), "edge of the soles for 20% of the time"),
        (course(clearance=(-0.004, "left_foot and right_foot")), "left_foot and right_foot meet, 4 mm deep"),
        (course(clearance=(0.002, "left_foot and right_foot")), "come as near as 2 mm"),
        (course(refusals=["kick left: out of reach"]), "kick left: out of reach"),
    ],
)
def test_what_is_beyond_the_limits_is_told(second: Course, complaint: str) -> None:
    found = reasons(ROBOT, [course(), second], Limits())
    assert len(found) == 1 and complaint in found[0]


def test_single_peaks_of_torque_and_flight_are_within_the_limits() -> None:
    peak = course(torques=with_some(course().torques, 2, 1.0), margins=with_some(course().margins, 100, math.nan))
    assert reasons(ROBOT, [course(), peak], Limits()) == []
    seen = figures([course(), peak], Limits())
    assert seen.torques[3] == 1.0 and seen.saturated[3] == pytest.approx(0.008)
    assert seen.margin == seen.low_margin == 0.05 and seen.on_edge == 0.0


def test_a_picture_is_drawn_of_plays_of_different_length_and_of_a_fall(tmp_path: Path) -> None:
    short = course()
    short = replace(short, **{name: getattr(short, name)[:100] for name in ("times", "torques", "speeds", "margins")})
    draw([course(), replace(short, seed=2, fall="leans")], Limits(), tmp_path / "rehearsal.png")
    assert (tmp_path / "rehearsal.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.sim
def test_a_leaning_robot_is_put_down_with_its_lean_on_both_soles() -> None:
    tilt = (0.0, math.sin(LEAN / 2), 0.0, math.cos(LEAN / 2))
    scenario = Scenario(Pose2D(1.0, 2.0, 0.5), (0.0, 0.0))
    world = World(scenario, WorldParameters.exact(), 1, joint_positions=leaning(), tilt=tilt)
    orientation = Rotation.from_quat(world.truth().base_orientation)
    expected = Rotation.from_euler("z", 0.5) * Rotation.from_quat(tilt)
    assert (orientation.inv() * expected).magnitude() < 1e-6
    world.advance(100)
    loads = world.sensors().foot_cells.sum(axis=1)
    assert loads.min() > 0.3 * loads.sum() > 0.3 * 0.8 * ROBOT.mass * 9.81
    world.close()


@pytest.mark.sim
def test_a_robot_on_one_foot_is_refused() -> None:
    joints = POSTURE.copy()
    joints[LEG_JOINTS.index("left_knee")] += 0.4
    with pytest.raises(ValueError, match="stands on both feet"):
        play([Part("stand", 1.0)], PARAMETERS, replace(standing(ROBOT), joint_positions=joints, tilt=(0, 0, 0, 1)), 1)


@pytest.mark.sim
def test_a_slow_walk_from_a_lean_is_within_the_limits_and_the_same_each_time() -> None:
    turn = Rotation.from_euler("y", LEAN / 3)
    joints = POSTURE.copy()
    joints[ANKLES] -= LEAN / 3
    present = present_of(ROBOT, [reading(joints, turn)])
    parts = parse(["walk", "0.2", "0", "0", "2"], PARAMETERS)
    first, second = (play(parts, PARAMETERS, present, 1) for _ in range(2))
    assert reasons(ROBOT, [first], Limits()) == []
    assert 0.2 < np.abs(first.torques).max() < 0.9 and 0.05 < np.abs(first.speeds).max() < 0.6
    np.testing.assert_array_equal(first.torques, second.torques)
    assert first.beginnings == [(0.0, "stand"), (0.5, "walk 0.2 0 0")]


@pytest.mark.sim
def test_a_driver_that_slows_the_joints_down_makes_a_walk_fall() -> None:
    parts = parse(["walk", "0.3", "0", "0", "5", "stand", "1"], PARAMETERS)
    seen = play(parts, PARAMETERS, standing(ROBOT), 1, rate=0.03)
    assert seen.fall and seen.times[-1] < 5.5
    assert "in walk 0.3 0 0: " in reasons(ROBOT, [seen], Limits())[0]  # and not in what was to come


@pytest.mark.sim
def test_a_kick_is_played_after_the_walk_has_ended() -> None:
    parts = parse(["walk", "0.1", "0", "0", "1.5", "kick", "right", "2"], PARAMETERS)
    seen = play(parts, PARAMETERS, standing(ROBOT), 2)
    assert seen.refusals == [] and not seen.fall
    kick_begins = seen.beginnings[-1][0]
    foot = seen.speeds[:, LEG_JOINTS.index("right_knee")]
    assert np.abs(foot[seen.times > kick_begins]).max() > 0.2


@pytest.mark.sim
def test_the_identification_s_experiment_is_watched_as_walks_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(experiment, "run_experiment", partial(experiment.run_experiment, longest=4.0))
    seen = experiment.play_experiment(ExperimentSettings(plan=PlanParameters(postures=9)), standing(ROBOT), 1)
    assert len(seen.times) == 1000 and not seen.fall  # 4 s at 250 Hz
    assert 0.05 < np.nanmin(seen.margins[250:]) and 0.1 < np.abs(seen.torques).max() < 0.9
    assert seen.beginnings and seen.clearance[0] > 0.01
