"""Pieces of line in rendered scenes: each must lie on paint."""

from __future__ import annotations

import numpy as np
from vision_evaluation import camera_pose, random_scenes, truth_of

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_vision.features import FeatureClass
from tulip_vision.lens import head_camera_lens
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.view import direction_of

FIELD, ROBOT, LENS = load_field(), load_robot(), head_camera_lens()
SEGMENTS = np.array([[segment.start, segment.end] for segment in FIELD.line_segments])


def distance_to_a_line(ends: np.ndarray) -> float:
    """Return how far the worse end, (2, 2) in map, is from the straight line that fits best [m]."""
    start, along = SEGMENTS[:, 0], SEGMENTS[:, 1] - SEGMENTS[:, 0]
    share = np.einsum("pnk,nk->pn", ends[:, None] - start, along) / (along**2).sum(axis=1)
    foot = start + np.clip(share, 0.0, 1.0)[..., None] * along
    return float(np.linalg.norm(ends[:, None] - foot, axis=2).max(axis=0).min())


def measure(scenes: int, seed: int) -> np.ndarray:
    """Return for each LINE within 6 m the distance of its worse end from the nearest painted line [m]."""
    renderer = CameraRenderer(CameraParameters(), FIELD, ROBOT, LENS)
    vision = Vision(VisionParameters(), LENS)
    rng = np.random.default_rng(seed)
    errors = []
    for number, scene in enumerate(random_scenes(scenes, FIELD, ROBOT, np.random.default_rng(seed))):
        features = vision.process(renderer.render(truth_of(scene), rng), number, camera_pose(scene, ROBOT))
        assert vision.last is not None
        for line in features.features:
            if line.kind != FeatureClass.LINE:
                continue
            rays = [direction_of(line.azimuth, line.elevation), direction_of(line.end_azimuth, line.end_elevation)]
            ends = vision.last.view.ground(np.array(rays))
            if np.linalg.norm(ends, axis=1).max() < 6.0:
                errors.append(distance_to_a_line(np.array([scene.footprint.transform(end) for end in ends])))
    return np.array(errors)


def test_pieces_of_line_lie_on_painted_lines() -> None:
    errors = measure(40, seed=6)
    assert len(errors) >= 80
    assert np.median(errors) < 0.01  # [m] a fifth of the line's width
    assert np.mean(errors > 0.05) < 0.08  # the rest: the net's ground bar, short arcs of the circle
