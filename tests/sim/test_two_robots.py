"""Two robots in one world: each with its own body and driver, seen by the other, and a whole match in lockstep."""

from __future__ import annotations

import dataclasses
import hashlib
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from tulip_description.field import load_field
from tulip_description.planar import Pose2D, wrap_angle
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_motion.interface import MotionMode, WalkCommand, WalkMode
from tulip_motion.motion import Motion
from tulip_motion.parameters import MotionParameters
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.lockstep_match import LockstepMatch
from tulip_sim.match_places import team_truth
from tulip_sim.match_report import MatchReport
from tulip_sim.match_rules import MatchRules, Role
from tulip_sim.match_settings import MatchSettings
from tulip_sim.parameters import WorldParameters
from tulip_sim.perception import PerceptionParameters
from tulip_sim.robot_stack import RobotSettings
from tulip_sim.scenario import Scenario
from tulip_sim.scene import Body
from tulip_sim.timing import TICK
from tulip_sim.truth import Truth
from tulip_sim.world import World
from tulip_strategy.interface import GamePhase
from tulip_vision.features import FeatureClass
from tulip_vision.lens import head_camera_lens
from tulip_vision.own_body import OwnBody
from tulip_vision.pipeline import Vision, VisionParameters

pytestmark = pytest.mark.sim

APART = Scenario(Pose2D(-2.0, 0.0, 0.0), (0.0, 2.5), poles=False, others=(Pose2D(1.0, -1.0, 2.0),))
WALKING, STANDING = (0.3, 0.0, 0.2), (0.0, 0.0, 0.0)
QUICK = MatchRules(
    trials=2,
    extra_pairs=0,
    initial_time=1.2,
    ready_time=0.2,
    set_time=0.4,
    playing_time=2.0,
    finished_time=0.4,
)
IDEAL = RobotSettings(perception=PerceptionParameters.ideal())


def bits(truth: Truth) -> str:
    digest = hashlib.sha256()
    for each in dataclasses.fields(truth):
        value = getattr(truth, each.name)
        parts = [part for other in value for part in vars(other).values()] if each.name == "others" else [value]
        for part in parts:
            digest.update(part.tobytes() if isinstance(part, np.ndarray) else repr(part).encode())
    return digest.hexdigest()


def walk(seconds: float, velocities: tuple[tuple[float, float, float], ...], seed: int = 3) -> tuple[Truth, ...]:
    """Let two robots walk or stand, each by its own motion control, and return the truth about both."""
    world = World(APART, WorldParameters(), seed)
    motions = [Motion(MotionParameters(), world.robot) for _ in velocities]
    try:
        for _ in range(round(seconds * 1000 / TICK)):
            for number, (motion, velocity) in enumerate(zip(motions, velocities, strict=True)):
                mode = WalkMode.WALK if any(velocity) else WalkMode.STAND
                motion.command(WalkCommand(0, mode, velocity))
                assert world.apply(motion.tick(world.sensors(number)), number) == ""
            world.advance(TICK)
        assert all(motion.mode is not MotionMode.FALLEN for motion in motions)
        return world.truth(0), world.truth(1)
    finally:
        world.close()


def test_two_robots_walk_and_the_same_seed_gives_the_same_bit_for_bit() -> None:
    first, second = walk(3.0, (WALKING, WALKING))
    assert [bits(each) for each in walk(3.0, (WALKING, WALKING))] == [bits(first), bits(second)]
    for truth, start in ((first, APART.robot), (second, APART.others[0])):
        assert math.dist((truth.footprint.x, truth.footprint.y), (start.x, start.y)) > 0.4
        assert truth.base_position[2] > 0.7


def test_each_robot_obeys_its_own_commands_alone() -> None:
    walks, stands = walk(2.0, (WALKING, STANDING))
    alone, _ = walk(2.0, (WALKING, WALKING))
    assert math.dist(walks.base_position, alone.base_position) < 0.01  # what the other does, far away, does not matter
    assert math.dist(stands.base_position[:2], (APART.others[0].x, APART.others[0].y)) < 0.02
    assert abs(wrap_angle(stands.footprint.yaw - APART.others[0].yaw)) < 0.02


@pytest.fixture
def world() -> Iterator[World]:
    made = World(APART, WorldParameters.exact(), 1)
    yield made
    made.close()


def test_truth_is_about_the_robot_asked_for_and_names_the_other(world: World) -> None:
    world.advance(20)
    first, second = world.truth(0), world.truth(1)
    np.testing.assert_array_equal(first.others[0].base_position, second.base_position)
    np.testing.assert_array_equal(second.others[0].joint_positions, first.joint_positions)
    assert (second.footprint.x, second.footprint.y) == pytest.approx((1.0, -1.0), abs=0.01)


def test_sensors_and_masses_of_the_robots_err_apart() -> None:
    world = World(APART, WorldParameters(), 1)
    try:
        world.advance(40)
        first, second = world.sensors(0), world.sensors(1)
        assert not np.array_equal(first.joint_positions, second.joint_positions)
        assert not np.array_equal(first.imu_angular_velocity, second.imu_angular_velocity)
    finally:
        world.close()


def test_a_robot_that_falls_against_another_pushes_it() -> None:
    near = replace(APART, robot=Pose2D(0.0, 0.0, 0.0), others=(Pose2D(0.45, 0.0, math.pi),))
    world = World(near, WorldParameters.exact(), 1)
    try:
        world.push((250.0, 0.0, 0.0), 150, 0)
        world.advance(1200)
        pushed, other = world.truth(0), world.truth(1)
        assert other.base_position[0] > 0.55
        assert pushed.base_position[0] < other.base_position[0]
    finally:
        world.close()


def test_touches_of_the_ball_are_counted_for_the_robot_that_touched_it(world: World) -> None:
    world.set_upright(Pose2D(1.0, -1.0, 0.0), 1)
    world.place_ball(1.6, -1.0, -1.5, 0.0)
    world.advance(600)
    second = world.truth(1)
    assert sum(second.foot_touches) + second.body_touches >= 1
    first = world.truth(0)
    assert sum(first.foot_touches) + first.body_touches == 0


def test_the_other_teams_map_is_turned_by_half_a_circle(world: World) -> None:
    world.advance(200)
    truth = world.truth(1)
    turned = truth.turned()
    assert (turned.footprint.x, turned.footprint.y) == pytest.approx((-truth.footprint.x, -truth.footprint.y))
    assert abs(wrap_angle(turned.footprint.yaw - truth.footprint.yaw - math.pi)) < 1e-9
    again = turned.turned()
    np.testing.assert_allclose(again.base_position, truth.base_position)
    np.testing.assert_allclose(again.others[0].base_position, truth.others[0].base_position)
    np.testing.assert_allclose(np.abs(again.base_orientation), np.abs(truth.base_orientation))
    poles = {(pole.x, pole.y, pole.colours) for pole in load_field().turned().poles}
    assert poles == {(-pole.x, -pole.y, pole.colours) for pole in load_field().poles}


@pytest.mark.parametrize("yaw", np.arange(-150.0, 181.0, 30.0))
def test_vision_finds_the_other_robot_and_its_place_whichever_side_its_bent_legs_show(yaw: float) -> None:
    """The trunk, not the feet, is below the marker of a robot with bent knees that is seen from the side."""
    robot, lens = load_robot(), head_camera_lens()
    world = World(replace(APART, others=(Pose2D(0.5, 0.2, math.radians(yaw)),)), WorldParameters.exact(), 1)
    try:
        camera = CameraParameters(team_colour="magenta", keeper_colour="cyan")
        posture = world.truth().joint_positions.copy()
        posture[13] = 0.35  # looks a little down
        truth = replace(world.truth(), joint_positions=posture)
        bent = standing_posture(robot, hip_height=0.53)
        other = truth.others[0]
        base_position = np.array([*other.base_position[:2], bent.base_height])
        other = replace(other, base_position=base_position, joint_positions=bent.joint_positions)
        truth = replace(truth, others=(other,))
        picture = CameraRenderer(camera, load_field(), robot, lens).render(truth, np.random.default_rng(1))
        body = Body(robot, "magenta")
        base, footprint = np.eye(4), np.eye(4)
        base[:3, 3] = truth.base_position
        footprint[:2, 3] = truth.footprint.x, truth.footprint.y
        camera_in_map = body.camera_in_map(body.links_in_map(base, posture))
        defaults = VisionParameters()
        parameters = replace(defaults, opponents=replace(defaults.opponents, team_colour="magenta"))
        vision = Vision(parameters, lens, OwnBody(robot))
        found = vision.process(picture, 1, np.linalg.inv(footprint) @ camera_in_map).features
        opponents = [each for each in found if each.kind is FeatureClass.OPPONENT]
        assert len(opponents) == 1
        assert opponents[0].azimuth == pytest.approx(math.atan2(0.2, 2.5), abs=0.1)
        camera_height = float(camera_in_map[2, 3])
        assert camera_height / math.tan(-opponents[0].elevation) == pytest.approx(math.hypot(2.5, 0.2), abs=0.3)
    finally:
        world.close()


def play(seed: int, rules: MatchRules = QUICK) -> tuple[MatchReport, list[str], list[float], list[set[str]]]:
    """Play a match; return its report, bits of the truth on the way, position errors at play, and strategies told."""
    match = LockstepMatch(seed, MatchSettings(rules=rules, robots=(IDEAL, IDEAL), keeper="stand still"))
    seen: list[str] = []
    errors: list[float] = []
    told: list[set[str]] = []

    def watch(now: LockstepMatch) -> None:
        seen.append(bits(now.world.truth(1)))
        if now.referee.phase is GamePhase.PLAYING:
            told.append({f"{now.referee.trial} {team} {robot.user.strategy}" for team, robot in enumerate(now.robots)})
            for team, robot in enumerate(now.robots):
                believed, real = robot.world_model.state(now.stamp).robot.pose, team_truth(now.world, team).footprint
                errors.append(math.dist((believed.x, believed.y), (real.x, real.y)))

    try:
        report = match.play(watch)
        assert [robot.refused for robot in match.robots] == [[], []]
        return report, seen, errors, told
    finally:
        match.close()


def test_a_match_in_lockstep_goes_through_its_trials_and_is_the_same_bit_for_bit() -> None:
    report, seen, errors, told = play(1)
    assert [(each.number, each.striker, each.result) for each in report.trials] == [(1, 0, "time"), (2, 1, "time")]
    assert report.decided_by == "draw"
    assert max(errors) < 0.1
    assert {name for names in told for name in names} == {
        "1 0 dribble_and_kick",
        "1 1 stand still",
        "2 0 stand still",
        "2 1 dribble_and_kick",
    }
    again, seen_again, _, _ = play(1)
    assert again == report
    assert seen_again == seen


def test_a_robot_pushed_over_is_taken_out_and_plays_on_when_it_is_back() -> None:
    rules = replace(QUICK, trials=1, playing_time=12.0, lying_limit=1.5, removal_time=3.0)
    match = LockstepMatch(2, MatchSettings(rules=rules, robots=(IDEAL, IDEAL), keeper="dribble_and_kick"))
    try:
        while match.referee.phase is not GamePhase.PLAYING:
            match.step()
        match.world.push((0.0, 300.0, 0.0), 150, 0)
        outside = []
        while not match.referee.report.finished:
            match.step()
            state = match.robots[0].game_input.state(match.stamp)
            assert state is not None
            if state.penalty and state.seconds_till_unpenalised == 1:
                outside.append(abs(match.world.truth(0).footprint.y))
        (trial,) = match.referee.report.trials
        assert trial.falls[0] >= 1
        assert trial.removals >= 1
        assert min(outside) > load_field().width / 2.0
        assert match.robots[0].motion.mode is not MotionMode.FALLEN
        assert match.referee.roles[0] is Role.STRIKER
        believed, real = match.robots[0].world_model.state(match.stamp).robot.pose, match.world.truth(0).footprint
        assert math.dist((believed.x, believed.y), (real.x, real.y)) < 0.3
    finally:
        match.close()
