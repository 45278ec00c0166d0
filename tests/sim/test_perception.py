"""Features from the truth: where the camera would see things, nothing that it cannot see, errors as asked for."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_sim.lockstep import Lockstep, Settings
from tulip_sim.perception import Perception, PerceptionParameters
from tulip_sim.scenario import make_scenario
from tulip_sim.truth import Truth
from tulip_vision.features import Feature, FeatureClass, Features
from tulip_vision.lens import head_camera_lens

pytestmark = pytest.mark.sim

FIELD, ROBOT, LENS = load_field(), load_robot(), head_camera_lens()
IDEAL = PerceptionParameters.ideal()
MS = 1_000_000  # [ns]
FAR_AWAY = (-20.0, 0.0)  # [m] where a ball is out of everybody's sight


def truth_of(
    robot: Pose2D, ball: tuple[float, float] = FAR_AWAY, keeper: Pose2D | None = None, pan: float = 0.0
) -> Truth:
    """Return a standing robot that looks to one side and 0.3 rad down."""
    posture = standing_posture(ROBOT)
    joints = posture.joint_positions.copy()
    joints[12:] = pan, 0.3
    zero, upright = np.zeros(3), np.array([0.0, 0.0, 0.0, 1.0])
    turn = np.array([0.0, 0.0, math.sin(robot.yaw / 2.0), math.cos(robot.yaw / 2.0)])
    base = np.array([robot.x, robot.y, posture.base_height])
    centre = np.array([*ball, FIELD.ball_radius])
    return Truth(
        0, base, turn, zero, zero, joints, np.zeros(14), centre, upright, zero, zero, keeper, (), (0, 0), 0, 0, True
    )


def see(truth: Truth, parameters: PerceptionParameters = IDEAL, seed: int = 0) -> Features:
    rng = np.random.default_rng(seed)
    perception = Perception(parameters, FIELD, ROBOT, LENS)
    pan, tilt = truth.joint_positions[12:].tolist()
    pose = camera_in_footprint(ROBOT, float(truth.base_position[2]), truth.base_orientation, pan, tilt)
    return perception.features(perception.expose(truth, rng), 5, pose, rng)


def of_kind(features: Features, *kinds: FeatureClass) -> list[Feature]:
    return [each for each in features.features if each.kind in kinds]


def on_ground(features: Features, azimuth: float, elevation: float, height: float = 0.0) -> np.ndarray:
    """Return where a direction meets a level plane, in base_footprint."""
    eye = features.camera_position
    reach = (eye[2] - height) / math.tan(-elevation)
    return eye[:2] + reach * np.array([math.cos(azimuth), math.sin(azimuth)])


@pytest.mark.parametrize("robot", [Pose2D(2.0, 0.5, 0.1), Pose2D(-1.0, -1.5, 2.0), Pose2D(0.0, 1.0, -1.2)])
def test_ideal_features_lie_exactly_where_the_field_has_its_landmarks(robot: Pose2D) -> None:
    found = see(truth_of(robot))
    places = {
        FeatureClass.GOAL_POST: [(post.x, post.y) for post in FIELD.goal_posts],
        FeatureClass.PENALTY_MARK: list(FIELD.penalty_marks),
    }
    for kind in (FeatureClass.CROSSING_L, FeatureClass.CROSSING_T, FeatureClass.CROSSING_X):
        places[kind] = [(each.x, each.y) for each in FIELD.crossings if f"CROSSING_{each.kind.value}" == kind.name]
    known = [each for each in found.features if each.kind in places and not math.isnan(each.elevation)]
    assert len(known) >= 2
    for each in known:
        place = robot.transform(on_ground(found, each.azimuth, each.elevation))
        assert min(math.dist(place, known) for known in places[each.kind]) < 1e-6


def test_ends_of_ideal_lines_lie_on_lines_of_the_field() -> None:
    robot = Pose2D(1.0, 0.5, 0.2)
    found = see(truth_of(robot))
    lines = of_kind(found, FeatureClass.LINE)
    assert len(lines) >= 3
    for line in lines:
        for azimuth, elevation in ((line.azimuth, line.elevation), (line.end_azimuth, line.end_elevation)):
            x, y = robot.transform(on_ground(found, azimuth, elevation))
            aside = [
                abs((y - s.start[1]) * math.cos(s.direction) - (x - s.start[0]) * math.sin(s.direction))
                for s in FIELD.line_segments
            ]
            assert min(aside) < 1e-6


def test_ball_has_its_direction_and_its_angular_radius() -> None:
    found = see(truth_of(Pose2D(), (2.0, 0.4)))
    (ball,) = of_kind(found, FeatureClass.BALL)
    assert on_ground(found, ball.azimuth, ball.elevation, FIELD.ball_radius) == pytest.approx([2.0, 0.4], abs=1e-6)
    distance = np.linalg.norm(np.array([2.0, 0.4, FIELD.ball_radius]) - found.camera_position)
    assert math.sin(ball.angular_radius) == pytest.approx(FIELD.ball_radius / distance, rel=1e-9)


@pytest.mark.parametrize(
    ("what", "ball", "keeper", "pan"),
    [
        ("in front", (2.0, 0.0), None, 0.0),
        ("behind an opponent", (2.0, 0.0), Pose2D(1.6, 0.14, math.pi), 0.0),  # its right leg
        ("behind the back", (-2.0, 0.0), None, 0.0),
        ("beside the picture", (2.0, 0.0), None, 1.5),
        ("beyond the range", (9.5, 0.0), None, 0.0),
        ("behind the own feet", (0.0, 0.0), None, 0.0),
    ],
)
def test_only_a_ball_in_view_is_told(what: str, ball: tuple[float, float], keeper: Pose2D | None, pan: float) -> None:
    found = of_kind(see(truth_of(Pose2D(), ball, keeper, pan)), FeatureClass.BALL)
    assert len(found) == (1 if what == "in front" else 0)


def test_opponent_hides_the_foot_of_the_post_behind_it_but_not_its_direction() -> None:
    post = FIELD.opponent_goal.posts[0]
    robot = Pose2D(post.x - 3.0, post.y, 0.0)
    free = of_kind(see(truth_of(robot)), FeatureClass.GOAL_POST)
    behind = of_kind(see(truth_of(robot, keeper=Pose2D(post.x - 0.4, post.y + 0.14, math.pi))), FeatureClass.GOAL_POST)
    straight = [each for each in free if abs(each.azimuth) < 0.02]
    assert len(straight) == 1 and not math.isnan(straight[0].elevation)
    hidden = [each for each in behind if abs(each.azimuth) < 0.02]
    assert all(math.isnan(each.elevation) for each in hidden)


def test_noise_has_the_standard_deviation_that_was_asked_for() -> None:
    truth = truth_of(Pose2D(), (2.0, 0.4))
    (exact,) = of_kind(see(truth), FeatureClass.BALL)
    noisy = replace(IDEAL, azimuth_noise=0.01, elevation_noise=0.02, size_noise=0.05)
    balls = [of_kind(see(truth, noisy, seed), FeatureClass.BALL)[0] for seed in range(300)]
    level = math.cos(exact.elevation)
    assert np.std([ball.azimuth for ball in balls]) * level == pytest.approx(0.01, rel=0.15)
    assert np.std([ball.elevation for ball in balls]) == pytest.approx(0.02, rel=0.15)
    assert np.std([ball.angular_radius / exact.angular_radius for ball in balls]) == pytest.approx(0.05, rel=0.15)


def test_misses_blank_pictures_and_false_findings_come_as_often_as_asked() -> None:
    truth = truth_of(Pose2D(), (2.0, 0.4))
    count = len(see(truth).features)

    def mean(parameters: PerceptionParameters, choose: Callable[[Features], int]) -> float:
        return float(np.mean([choose(see(truth, parameters, seed)) for seed in range(300)]))

    assert mean(replace(IDEAL, miss=0.3), lambda each: len(each.features)) == pytest.approx(0.7 * count, rel=0.1)
    assert mean(replace(IDEAL, blank=0.4), lambda each: not each.features) == pytest.approx(0.4, abs=0.1)
    extra = mean(replace(IDEAL, false_landmarks=2.0), lambda each: len(each.features) - count)
    assert 0.5 < extra <= 2.3  # those that would lie above the horizon or too far away are left out


@pytest.mark.parametrize("wrong", [{"miss": 1.5}, {"azimuth_noise": -0.1}, {"latency": 5.0}])
def test_parameters_out_of_range_are_refused_by_name(wrong: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(wrong))):
        PerceptionParameters(**wrong)


@pytest.mark.parametrize("latency", [0.032, 0.048, 0.2])
def test_lockstep_gives_features_after_the_latency_and_no_pictures(latency: float) -> None:
    delays: list[int] = []
    topics: set[str] = set()

    def listen(topic: str, stamp: int, value: object) -> None:
        topics.add(topic)
        if topic == "features":
            delays.append(stamp - value.stamp)  # type: ignore[attr-defined]

    scenario = make_scenario("open", np.random.default_rng(1), FIELD)
    trial = Lockstep(scenario, 1, Settings(perception=PerceptionParameters(latency=latency)), listen)
    try:
        while trial.stamp < 1000 * MS:
            trial.step()
        assert len(delays) >= 12
        assert set(delays) == {round(latency * 1000) * MS}
        assert "camera/image_raw" not in topics
        assert trial.world_model.state(trial.stamp).ball is not None
    finally:
        trial.close()
