"""The renderer of the head camera: geometry against ray casting and against pybullet's TinyRenderer, and its faults."""

from __future__ import annotations

import math

import numpy as np
import pybullet
import pytest

from tulip_description.camera_pose import camera_in_footprint
from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.posture import standing_posture
from tulip_description.robot import load_robot
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_sim.scene import COLOURS, Boxes, Scene, keeper_boxes
from tulip_sim.truth import Truth
from tulip_vision.lens import Lens, head_camera_lens

FIELD = load_field()
ROBOT = load_robot()
PINHOLE = Lens(640, 480, [[455.0, 0.0, 319.5], [0.0, 455.0, 239.5], [0.0, 0.0, 1.0]], np.zeros(5))
PURPLE = np.array([255.0, 0.0, 255.0])  # nothing else has this colour
FAULTLESS = CameraParameters(flicker=0.0, vignetting=0.0, blur=0.0, noise=0.0)


@pytest.fixture(scope="module")
def pinhole() -> CameraRenderer:
    return CameraRenderer(FAULTLESS, FIELD, ROBOT, PINHOLE)


@pytest.fixture(scope="module")
def renderer() -> CameraRenderer:
    return CameraRenderer(CameraParameters(), FIELD, ROBOT, head_camera_lens())


def _camera(x: float, y: float, z: float, yaw: float, tilt: float, roll: float = 0.0) -> np.ndarray:
    forward = np.array([math.cos(yaw) * math.cos(tilt), math.sin(yaw) * math.cos(tilt), -math.sin(tilt)])
    right = np.array([math.sin(yaw), -math.cos(yaw), 0.0])
    down = np.cross(forward, right)
    pose = np.eye(4)
    pose[:3, 0] = math.cos(roll) * right + math.sin(roll) * down
    pose[:3, 1] = math.cos(roll) * down - math.sin(roll) * right
    pose[:3, 2] = forward
    pose[:3, 3] = x, y, z
    return pose


def _truth(head: tuple[float, float], ball: tuple[float, float], yaw: float = 0.0) -> Truth:
    posture = standing_posture(ROBOT)
    joints = np.array(posture.joint_positions)
    joints[12:] = head
    zero = np.zeros(3)
    return Truth(
        stamp=0,
        base_position=np.array([-1.0, 0.5, posture.base_height]),
        base_orientation=np.array([0.02, 0.05, math.sin(yaw / 2.0), math.cos(yaw / 2.0)]) / math.hypot(1.0, 0.02, 0.05),
        base_linear_velocity=zero,
        base_angular_velocity=zero,
        joint_positions=joints,
        joint_velocities=np.zeros(14),
        ball_position=np.array([*ball, FIELD.ball_radius]),
        ball_orientation=np.array([0.0, 0.0, 0.0, 1.0]),
        ball_linear_velocity=zero,
        ball_angular_velocity=zero,
        keeper=Pose2D(4.3, 0.2, math.pi),
        keeper_path=(),
        foot_touches=(0, 0),
        body_touches=0,
        keeper_touches=0,
        poles=True,
    )


def test_camera_hangs_where_the_description_says():
    truth = _truth((0.4, 0.3), (1.0, 0.0))
    renderer = CameraRenderer(FAULTLESS, FIELD, ROBOT, PINHOLE)
    base = np.eye(4)
    x, y, z, w = truth.base_orientation
    base[:3, :3] = np.array(pybullet.getMatrixFromQuaternion([x, y, z, w])).reshape(3, 3)
    base[:3, 3] = truth.base_position
    camera = renderer._body.camera_in_map(renderer._body.links_in_map(base, truth.joint_positions))
    footprint = camera_in_footprint(ROBOT, truth.base_position[2], truth.base_orientation, 0.4, 0.3)
    yaw = math.atan2(base[1, 0], base[0, 0])
    level = np.eye(4)
    level[:2, :2] = Pose2D(0.0, 0.0, yaw).rotation()
    level[:2, 3] = truth.base_position[:2]
    assert camera == pytest.approx(level @ footprint, abs=1e-9)


class _Tiny:
    """The same scene in pybullet's own software renderer."""

    def __init__(self) -> None:
        self.client = pybullet.connect(pybullet.DIRECT)

    def body(self, shape: int, position, orientation=(0.0, 0.0, 0.0, 1.0), **size) -> int:
        visual = pybullet.createVisualShape(shape, physicsClientId=self.client, **size)
        return pybullet.createMultiBody(0.0, -1, visual, position, orientation, physicsClientId=self.client)

    def mask(self, camera: np.ndarray, bodies: list[int]) -> np.ndarray:
        lens, near = PINHOLE, 0.05
        fx, fy, cx, cy = (lens.camera_matrix[i, j] for i, j in ((0, 0), (1, 1), (0, 2), (1, 2)))
        projection = pybullet.computeProjectionMatrix(
            -(cx + 0.5) * near / fx,
            (639.5 - cx) * near / fx,
            -(479.5 - cy) * near / fy,
            (cy + 0.5) * near / fy,
            near,
            30.0,
        )
        eye, target = camera[:3, 3], camera[:3, 3] + camera[:3, 2]
        view = pybullet.computeViewMatrix(eye, target, -camera[:3, 1])
        image = pybullet.getCameraImage(
            640, 480, view, projection, renderer=pybullet.ER_TINY_RENDERER, physicsClientId=self.client
        )
        return np.isin(np.reshape(image[4], (480, 640)), bodies)

    def close(self) -> None:
        pybullet.disconnect(self.client)


@pytest.fixture
def tiny():
    other = _Tiny()
    yield other
    other.close()


def _centre(mask: np.ndarray) -> np.ndarray:
    rows, columns = np.nonzero(mask)
    return np.array([columns.mean(), rows.mean()])


def _agreement(a: np.ndarray, b: np.ndarray) -> float:
    return float((a & b).sum() / (a | b).sum())


@pytest.mark.parametrize(("distance", "least"), [(0.6, 0.92), (1.0, 0.92), (3.0, 0.9), (6.0, 0.84)])
def test_ball_is_where_and_as_large_as_in_tiny_renderer(pinhole, tiny, distance, least):
    centre = np.array([distance - 1.0, 0.2, FIELD.ball_radius])
    camera = _camera(-1.0, 0.0, 1.16, 0.05, math.atan2(1.0, distance))
    scene = Scene(centre, poles=False)
    mask = _ball_mask(pinhole, camera, scene)
    # TinyRenderer's sphere is a mesh inside the true one and covers 7 % less: the next test is the sharper one.
    other = tiny.mask(camera, [tiny.body(pybullet.GEOM_SPHERE, centre, radius=FIELD.ball_radius)])
    assert np.abs(_centre(mask) - _centre(other)).max() < 1.0
    assert _agreement(mask, other) > least


def _ball_mask(renderer: CameraRenderer, camera: np.ndarray, scene: Scene) -> np.ndarray:
    picture = renderer.render_scene(camera, scene).astype(int)
    empty = renderer.render_scene(camera, Scene(None, poles=False)).astype(int)
    return (np.abs(picture - empty).max(axis=2) > 60) & (picture[..., 2] > picture[..., 1] + 30)


@pytest.mark.parametrize(("azimuth", "distance"), [(0.0, 0.5), (0.6, 1.0), (-0.6, 1.0), (0.6, 3.0), (-0.55, 6.0)])
def test_ball_covers_the_pixels_whose_rays_meet_it_at_the_edge_of_a_barrel_lens_too(renderer, azimuth, distance):
    lens = head_camera_lens()
    camera = _camera(0.0, 0.0, 1.16, 0.0, math.atan2(1.0, distance) - 0.2)
    ball = np.array([distance * math.cos(azimuth), distance * math.sin(azimuth), FIELD.ball_radius])
    mask = _ball_mask(renderer, camera, Scene(ball, poles=False))
    middle = (ball - camera[:3, 3]) @ camera[:3, :3]
    rays = lens.ray_table().astype(float)
    expected = (np.linalg.norm(np.cross(rays, middle), axis=2) < FIELD.ball_radius) & (rays @ middle > 0.0)
    assert np.abs(_centre(mask) - _centre(expected)).max() < 0.4
    assert abs(int(mask.sum()) - int(expected.sum())) < 1.2 * math.sqrt(expected.sum())  # a third of a pixel of radius


def test_goal_and_keeper_have_the_outlines_of_tiny_renderer(pinhole, tiny):
    camera = _camera(1.5, 0.5, 1.16, -0.1, 0.12)
    keeper = Pose2D(4.0, -0.5, 2.8)
    boxes = keeper_boxes(keeper, "cyan")
    boxes = Boxes(boxes.transforms, boxes.sizes, np.tile(PURPLE, (len(boxes.sizes), 1)))
    picture = pinhole.render_scene(camera, Scene(None, boxes, poles=False)).astype(int)
    without = pinhole.render_scene(camera, Scene(None, poles=False)).astype(int)
    turn = pybullet.getQuaternionFromEuler([0.0, 0.0, keeper.yaw])
    figure = [
        tiny.body(pybullet.GEOM_BOX, transform[:3, 3], turn, halfExtents=size / 2.0)
        for transform, size in zip(boxes.transforms, boxes.sizes, strict=True)
    ]
    other = tiny.mask(camera, figure)
    mask = np.minimum(picture[..., 0], picture[..., 2]) - picture[..., 1] > 70
    assert np.abs(_centre(mask) - _centre(other)).max() < 1.0
    assert _agreement(mask, other) > 0.93
    goal = FIELD.opponent_goal
    frame = [
        tiny.body(pybullet.GEOM_CYLINDER, (post.x, post.y, post.height / 2.0), radius=post.radius, length=post.height)
        for post in goal.posts
    ]
    sideways = pybullet.getQuaternionFromEuler([math.pi / 2.0, 0.0, 0.0])
    bar = (goal.x, 0.0, goal.height + goal.posts[0].radius)
    frame.append(
        tiny.body(pybullet.GEOM_CYLINDER, bar, sideways, radius=goal.posts[0].radius, length=2.0 * goal.posts[0].y)
    )
    yellow = (without[..., 2] > without[..., 0] + 60) & (without[..., 1] > without[..., 0] + 40)
    other = tiny.mask(camera, frame) & ~tiny.mask(camera, figure)
    assert _agreement(yellow & ~mask, other) > 0.85


def _rays_meet_box(lens: Lens, camera: np.ndarray, transform: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Cast the ray of each pixel at a box: slab test, independent of polygons and projection."""
    rays = lens.ray_table().astype(float) @ (transform[:3, :3].T @ camera[:3, :3]).T
    start = transform[:3, :3].T @ (camera[:3, 3] - transform[:3, 3])
    with np.errstate(divide="ignore"):
        a, b = (-size / 2.0 - start) / rays, (size / 2.0 - start) / rays
    enter, leave = np.minimum(a, b).max(axis=2), np.maximum(a, b).min(axis=2)
    hit: np.ndarray = (leave > enter) & (leave > 0.0)
    return hit


@pytest.mark.parametrize("seed", range(12))
def test_boxes_near_far_and_partly_behind_cover_the_pixels_whose_rays_meet_them(renderer, seed):
    rng = np.random.default_rng(seed)
    lens = head_camera_lens()
    camera = _camera(0.0, 0.0, 1.16, 0.3, 0.5, float(rng.uniform(-0.3, 0.3)))
    size = rng.uniform(0.05, 1.2, 3)
    place = camera[:3, :3] @ np.array([rng.uniform(-0.7, 0.7), rng.uniform(-0.5, 0.5), rng.uniform(-0.2, 2.0)])
    transform = np.eye(4)
    transform[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    transform[:3, 3] = camera[:3, 3] + place
    if np.all(np.abs(transform[:3, :3].T @ (camera[:3, 3] - transform[:3, 3])) < size / 2.0 + 0.05):
        transform[:3, 3] += camera[:3, 2] * 1.5  # a camera inside a box sees nothing that could be compared
    expected = _rays_meet_box(lens, camera, transform, size)
    boxes = Boxes(transform[None], size[None], PURPLE[None])
    picture = renderer.render_scene(camera, Scene(None, boxes, poles=False))
    picture = picture.astype(int)
    drawn = np.minimum(picture[..., 0], picture[..., 2]) - picture[..., 1] > 70
    wrong = int((drawn != expected).sum())
    rim = np.zeros_like(expected)
    rim[1:] |= expected[1:] != expected[:-1]
    rim[:, 1:] |= expected[:, 1:] != expected[:, :-1]
    assert wrong <= 0.7 * rim.sum() + 5  # less than one pixel along the outline


def test_markers_on_chest_and_back_hide_behind_the_trunk_at_any_distance(pinhole):
    magenta = np.array(COLOURS["magenta"])
    for distance in (1.0, 2.0, 4.0):
        camera = _camera(0.0, 0.0, 1.16, 0.0, 0.2)
        seen = []
        for yaw in (math.pi, math.pi / 2.0):
            boxes = keeper_boxes(Pose2D(distance, 0.0, yaw), "magenta")
            chest = Boxes(boxes.transforms[:3], boxes.sizes[:3], boxes.colours[:3])
            picture = pinhole.render_scene(camera, Scene(None, chest, poles=False)).astype(float)
            hue = picture / np.maximum(picture.sum(axis=2, keepdims=True), 1.0)
            seen.append(int((np.abs(hue - magenta / magenta.sum()).max(axis=2) < 0.08).sum()))
        expected = 455.0**2 * 0.24 * 0.20 / distance**2  # [px] of the chest's plate seen from the front
        assert 0.6 * expected < seen[0] < 1.4 * expected
        assert seen[1] < 0.2 * seen[0]


def test_lines_are_white_and_carpet_is_green_where_the_field_says(renderer):
    lens = head_camera_lens()
    rng = np.random.default_rng(4)
    right, total = 0, 0
    for _ in range(12):
        camera = _camera(rng.uniform(-3.0, 3.0), rng.uniform(-2.0, 2.0), 1.16, rng.uniform(-3.1, 3.1), 0.7)
        picture = renderer.render_scene(camera, Scene(None, poles=False)).astype(int)
        points = np.concatenate([camera[:2, 3] + rng.uniform(-2.5, 2.5, (600, 2)), _on_lines(rng, 200)])
        offset = np.array([_distance_to_paint(point) for point in points])
        pixels = lens.project((np.column_stack([points, np.zeros(len(points))]) - camera[:3, 3]) @ camera[:3, :3])
        near = np.linalg.norm(points - camera[:2, 3], axis=1) < 3.0
        keep = near & np.isfinite(pixels).all(axis=1) & (np.abs(offset) > 0.012)
        keep &= (np.abs(points[:, 0]) < 4.3) & (np.abs(points[:, 1]) < 2.95)  # away from posts and nets
        for point, pixel in zip(offset[keep], pixels[keep], strict=True):
            column, row = np.round(pixel).astype(int)
            if 0 <= column < 640 and 0 <= row < 480:
                white = picture[row, column, 0] > 120 and picture[row, column, 2] > 120
                right += white == (point < 0.0)
                total += 1
    assert total > 1000
    assert right / total > 0.99


def _on_lines(rng: np.random.Generator, count: int) -> np.ndarray:
    lines = FIELD.line_segments
    chosen = [lines[int(i)] for i in rng.integers(0, len(lines), count)]
    share = rng.uniform(0.0, 1.0, count)
    points = [np.array(c.start) + s * (np.array(c.end) - np.array(c.start)) for c, s in zip(chosen, share, strict=True)]
    return np.array(points) + rng.normal(0.0, 0.005, (count, 2))


def _distance_to_paint(point: np.ndarray) -> float:
    """How far a point is outside the nearest painted line [m]; negative on it."""
    distances = []
    for line in FIELD.line_segments:
        start, end = np.array(line.start), np.array(line.end)
        share = np.clip((point - start) @ (end - start) / line.length**2, 0.0, 1.0)
        distances.append(float(np.linalg.norm(point - start - share * (end - start))))
    distances.append(abs(math.hypot(*point) - FIELD.centre_circle.radius))
    mark = min(math.hypot(point[0] - x, point[1] - y) for x, y in FIELD.penalty_marks)
    if mark < 0.1:
        return 0.0  # inside the mark's surroundings: not judged
    return min(distances) - FIELD.line_width / 2.0


def test_lines_at_six_metres_have_no_gaps(renderer):
    lens = head_camera_lens()
    camera = _camera(-2.5, 0.0, 1.16, 0.0, 0.25)
    picture = renderer.render_scene(camera, Scene(None, poles=False)).astype(int)
    y = np.linspace(-1.5, 1.5, 200)
    line = np.column_stack([np.full(200, 3.5), y, np.zeros(200)])  # the goal area's front, 6 m ahead
    pixels = lens.project((line - camera[:3, 3]) @ camera[:3, :3])
    columns, rows = np.round(pixels).astype(int).T
    brightness = picture[..., 2]  # red: low on the carpet
    carpet = np.median(brightness[260:300])
    peak = np.array([brightness[row - 1 : row + 2, column].max() for row, column in zip(rows, columns, strict=True)])
    assert peak.min() > carpet + 25


def test_same_seed_gives_the_same_picture_and_another_seed_only_other_noise(renderer):
    truth = _truth((0.0, 0.5), (0.4, 0.5))
    first = renderer.render(truth, np.random.default_rng(7))
    again = renderer.render(truth, np.random.default_rng(7))
    other = renderer.render(truth, np.random.default_rng(8))
    assert first.shape == (480, 640, 3) and first.dtype == np.uint8
    assert np.array_equal(first, again)
    assert not np.array_equal(first, other)
    difference = first.astype(float) - other
    assert 3.0 < (difference - difference.mean()).std() < 8.0  # two pictures' noise of 4 grey levels: 5.7


def test_ball_at_the_feet_is_seen_by_a_head_that_looks_down(renderer):
    truth = _truth((0.0, 1.0), (-0.65, 0.45))
    picture = renderer.render(truth, np.random.default_rng(1)).astype(int)
    orange = (picture[..., 2] > 150) & (picture[..., 1] < 150) & (picture[..., 0] < 90)
    rows, _ = np.nonzero(orange)
    assert 3000 < orange.sum() < 12000
    assert rows.mean() > 200


@pytest.mark.parametrize("tilt", [-0.7, 0.3, 1.3])
@pytest.mark.parametrize("pan", [-2.4, 0.0, 2.4])
def test_every_head_pose_gives_a_picture_even_of_a_robot_that_lies_on_the_ground(renderer, pan, tilt):
    truth = _truth((pan, tilt), (0.4, 0.5))
    lying = Truth(
        **{
            **vars(truth),
            "base_position": np.array([-1.0, 0.5, 0.15]),
            "base_orientation": np.array([0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)]),
        }
    )
    for state in (truth, lying):
        picture = renderer.render(state, np.random.default_rng(0))
        assert picture.std() > 2.0  # more than one flat colour without noise would have


@pytest.mark.parametrize("height", [0.05, 0.5])
def test_a_camera_on_its_head_can_see_the_wall_in_any_number_of_rows(renderer, height):
    """Of a robot that rolls on the ground: the wall comes into the picture from below, row by row."""
    for tilt in np.radians(np.arange(0.0, 90.0, 0.5)):
        camera = _camera(1.0, 0.5, height, 0.3, tilt, roll=math.pi)
        assert renderer.render_scene(camera, Scene(None)).shape == (480, 640, 3)


def test_contact_shadow_darkens_the_carpet_beside_the_ball_and_fades_when_it_is_lifted(pinhole):
    camera = _camera(-1.0, 0.0, 1.16, 0.0, 0.7)
    pixel = PINHOLE.project((np.array([[0.44, 0.06, 0.0]]) - camera[:3, 3]) @ camera[:3, :3])[0].round().astype(int)
    carpet, low, high = (
        float(pinhole.render_scene(camera, Scene(ball, poles=False))[pixel[1], pixel[0]].sum())
        for ball in (None, np.array([0.5, 0.0, FIELD.ball_radius]), np.array([0.5, 0.0, 1.5]))
    )
    assert low < 0.9 * carpet
    assert high > 0.95 * carpet


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"noise": -1.0}, "noise is -1.0 grey levels"),
        ({"blur": math.nan}, "blur is nan px"),
        ({"brightness": 0.0}, "brightness is 0.0"),
        ({"vignetting": 1.0}, "vignetting is 1.0"),
        ({"keeper_colour": "red"}, "cyan or magenta"),
    ],
)
def test_parameter_out_of_range_is_refused_by_name(change, words):
    with pytest.raises(ValueError, match=words):
        CameraParameters(**change)


def test_robot_without_a_head_has_no_camera_to_render():
    with pytest.raises(ValueError, match="has no camera"):
        CameraRenderer(FAULTLESS, FIELD, load_robot("table"), PINHOLE)
