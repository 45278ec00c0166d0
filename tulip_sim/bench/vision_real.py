"""Vision on pictures that no simulator made: other robots, halls and lenses, from ../shared/data/real_images."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import yaml
from numpy.typing import NDArray

from tulip_description.model import OPTICAL_ROTATION
from tulip_sim.bench.runner import Row
from tulip_vision.ball import BallParameters
from tulip_vision.features import FeatureClass
from tulip_vision.lens import Lens
from tulip_vision.pipeline import Vision, VisionParameters
from tulip_vision.segmentation import SegmentationParameters
from tulip_vision.view import direction_of

Array = NDArray[np.float64]

FOLDER = Path(
    os.environ.get("TULIP_REAL_IMAGES", Path(__file__).resolve().parents[3] / "shared" / "data" / "real_images")
)
"""The pictures; another place can be named in the environment."""

RED_BALLS = {"lens_pose/image0000011.jpg", "lens_pose/image0000019.jpg"}
"""Have a red ball, as a look at them shows; the manifest does not say. To claim it as orange is right or wrong."""
ORANGE = (  # labelled by hand: file, lens model, focal length [px], height [m], tilt [deg], ball's radius [m], u, v
    ("orange_era/convexhull1.png", "equidistant", 330.0, 0.9, 27.0, 0.0935, 417.0, 286.0),
    ("orange_era/rgb.jpg", "plumb_bob", 900.0, 1.0, 14.0, 0.05, 362.0, 492.0),
)
YELLOW_RADIUS = 0.11  # [m] the balls of the Middle Size League
YELLOW_FOCAL = 330.0  # [px] a guess: 608 px show about 100 deg
SQUARE = math.radians(3.0)  # pieces of line this close to two directions at a right angle fit the field


@dataclass(frozen=True)
class Found:
    """A ball in a picture.

    Attributes:
        u, v: Its middle [px].
        radius: [px].
    """

    u: float
    v: float
    radius: float


def manifest() -> list[dict[str, Any]]:
    """Return the entries of the manifest.

    Raises:
        OSError: if it is not there.
    """
    entries: list[dict[str, Any]] = json.loads((FOLDER / "manifest.json").read_text())["files"]
    return entries


def looking(height: float, tilt: float) -> Array:
    """Return the (4, 4) pose of a camera at a height [m] that looks down by a tilt [rad]."""
    pose = np.eye(4)
    c, s = math.cos(tilt), math.sin(tilt)
    pose[:3, :3] = np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]]) @ OPTICAL_ROTATION
    pose[2, 3] = height
    return pose


def see(name: str, lens: Lens, pose: Array, parameters: VisionParameters) -> tuple[Vision, list[Found]]:
    """Look at one picture; return vision after it and the balls that it claims.

    Raises:
        OSError: if there is no such picture.
    """
    picture = cv2.imread(str(FOLDER / name))
    if picture is None:
        raise OSError(f"{FOLDER / name} is no picture")
    vision = Vision(parameters, lens)
    features = vision.process(np.asarray(picture, np.uint8), 0, pose)
    assert vision.last is not None
    balls = []
    for feature in features.features:
        if feature.kind == FeatureClass.BALL:
            direction = direction_of(feature.azimuth, feature.elevation)
            u, v = vision.last.view.pixels_of_directions(direction[None])[0].tolist()
            balls.append(Found(u, v, feature.angular_radius / vision.last.view.angle_per_pixel(direction)))
    return vision, balls


def known_lens(entry: dict[str, Any]) -> tuple[Lens, Array]:
    """Return lens and (4, 4) camera pose that the manifest gives for a picture."""
    given = yaml.safe_load(entry["annotation"]["lens"])
    width, height = entry["size"]
    focal, model = float(given["focal_length"]), str(given["projection"]).lower()
    u, v = ((size - 1.0) / 2.0 - centre for size, centre in zip((width, height), given["centre"], strict=True))
    matrix = [[focal, 0.0, u], [0.0, focal, v], [0.0, 0.0, 1.0]]
    pose = np.array(given["Hoc"], dtype=np.float64)  # its camera looks along x, with z up
    left, _, right = np.linalg.svd(pose[:3, :3])  # written with six digits only
    pose[:3, :3] = left @ right @ OPTICAL_ROTATION
    return Lens(width, height, matrix, given["k"] + [0.0, 0.0], model), pose


def squareness(pieces: list[tuple[Array, Array]]) -> tuple[float, float]:
    """Return how much of some pieces of line fits two directions at a right angle.

    Args:
        pieces: Both ends, (2,) on the ground [m].

    Returns:
        Length that fits within SQUARE, and the whole length [m].
    """
    along = np.array([end - start for start, end in pieces])
    length = np.linalg.norm(along, axis=1)
    angle = np.arctan2(along[:, 1], along[:, 0])
    off = np.abs((angle[:, None] - angle + math.pi / 4) % (math.pi / 2) - math.pi / 4)
    return float(((off < SQUARE) * length).sum(axis=1).max()), float(length.sum())


def yellow_scenes() -> Iterator[tuple[str, Lens, Array, Found]]:
    """Yield the pictures with a yellow ball: name, guessed lens and pose, and where the manifest has the ball.

    Lens and pose are not known. A ball's middle lies below the horizon by (height - radius) / radius of its own radii,
    so a line through all balls of one camera gives the horizon and the camera's height.
    """
    cameras: dict[str, list[tuple[dict[str, Any], Found]]] = {}
    for entry in manifest():
        if entry["annotation"]["format"] != "yolo-boxes":
            continue
        names, (width, height) = entry["annotation"]["classes"], entry["size"]
        box = next(box for box in entry["annotation"]["boxes"] if names[int(box[0])] == "ball")
        u, v, radius = box[1] * width, box[2] * height, 0.25 * (box[3] * width + box[4] * height)
        cameras.setdefault(Path(entry["file"]).name[:4], []).append((entry, Found(u, v, radius)))
    # All cameras sit alike; the clip keeps two balls at one distance from giving nonsense.
    everything = [ball for group in cameras.values() for _, ball in group]
    radii, rows = np.array([ball.radius for ball in everything]), np.array([ball.v for ball in everything])
    slope, horizon = np.polyfit(radii, rows, 1).tolist()
    above = YELLOW_RADIUS * (1.0 + float(np.clip(slope, 2.0, 10.0)))
    for group in cameras.values():
        for entry, ball in group:
            width, height = entry["size"]
            matrix = [[YELLOW_FOCAL, 0.0, width / 2], [0.0, YELLOW_FOCAL, height / 2], [0.0, 0.0, 1.0]]
            tilt = (height / 2 - horizon) / YELLOW_FOCAL
            yield entry["file"], Lens(width, height, matrix, np.zeros(4), "equidistant"), looking(above, tilt), ball


def measure_real() -> Row:
    """Look at all real pictures; the reason instead, if they are not there."""
    try:
        entries = manifest()
    except OSError:
        return {"part": "real", "skipped": "the real pictures are not on this computer"}
    row: Row = {"part": "real"}
    right, claims = 0, []
    for name, model, focal, height, tilt, radius, u, v in ORANGE:
        width, rows = next(entry["size"] for entry in entries if entry["file"] == name)
        lens = Lens(width, rows, [[focal, 0, width / 2], [0, focal, rows / 2], [0, 0, 1]], np.zeros(4), model)
        parameters = VisionParameters(ball=BallParameters(radius=radius))
        _, balls = see(name, lens, looking(height, math.radians(tilt)), parameters)
        right += any(math.hypot(ball.u - u, ball.v - v) < ball.radius for ball in balls)
        claims += [name for ball in balls if math.hypot(ball.u - u, ball.v - v) >= ball.radius]
    row["orange balls"], row["orange balls found"] = len(ORANGE), right

    fits, whole, with_lines, red = 0.0, 0.0, 0, 0
    for entry in entries:
        if "lens" not in entry["annotation"]:
            continue
        lens, pose = known_lens(entry)
        vision, balls = see(entry["file"], lens, pose, VisionParameters())
        red += len(balls) if entry["file"] in RED_BALLS else 0
        claims += [entry["file"]] * (0 if entry["file"] in RED_BALLS else len(balls))
        assert vision.last is not None
        pieces = [(piece.start, piece.end) for piece in vision.last.lines.pieces]
        if len(pieces) > 1:
            length, of = squareness(pieces)
            fits, whole, with_lines = fits + length, whole + of, with_lines + 1
    row["pictures with red balls"], row["red balls claimed as orange"] = len(RED_BALLS), red
    row["pictures with known lens"] = sum("lens" in entry["annotation"] for entry in entries)
    row["of them with two or more pieces of line"] = with_lines
    row["length of pieces [m]"], row["of that along the field's two directions [m]"] = round(whole, 2), round(fits, 2)

    colours = VisionParameters().segmentation.colours
    yellow = SegmentationParameters(colours=replace(colours, orange=colours.yellow))
    found, false, missed, number = 0, 0, [], 0
    for name, lens, pose, ball in yellow_scenes():
        number += 1
        _, balls = see(name, lens, pose, VisionParameters())
        claims += [name] * len(balls)
        parameters = VisionParameters(ball=BallParameters(radius=YELLOW_RADIUS), segmentation=yellow)
        _, balls = see(name, lens, pose, parameters)
        hit = sum(math.hypot(each.u - ball.u, each.v - ball.v) < ball.radius for each in balls)
        found += min(hit, 1)
        false += len(balls) - hit
        missed += [] if hit else [name]
    row["orange balls claimed where there is none"] = claims
    row["yellow balls"], row["yellow balls found"], row["false yellow balls"] = number, found, false
    row["yellow balls missed in"] = missed
    return row


def real_table(row: Row) -> list[str]:
    """Return the figures as markdown."""
    lines = ["### Real pictures", ""]
    if "skipped" in row:
        return [*lines, f"Left out: {row['skipped']}."]
    claims = row["orange balls claimed where there is none"]
    yellow, claimed = row["yellow balls found"], row["yellow balls found"] + row["false yellow balls"]
    share = row["of that along the field's two directions [m]"] / max(row["length of pieces [m]"], 1e-9)
    return [
        *lines,
        "| what | asked for | came out |",
        "| --- | --- | --- |",
        f"| orange balls of 2012 found | all | {row['orange balls found']} of {row['orange balls']} |",
        f"| orange balls claimed where there is none | 0 | {len(claims)}{': ' if claims else ''}{', '.join(claims)} |",
        f"| red balls claimed as orange (right or wrong as one likes) | |"
        f" {row['red balls claimed as orange']} in {row['pictures with red balls']} pictures |",
        f"| yellow balls among people, robots and shirts, with the ball's colour set to yellow, lens and pose guessed |"
        f" | recall {yellow} of {row['yellow balls']}, precision {yellow} of {claimed} |",
        f"| pieces of line in {row['of them with two or more pieces of line']} of {row['pictures with known lens']}"
        " pictures with known lens and pose that, on the ground, keep to two directions at a right angle within 3 deg"
        f" | | {share:.1%} of {row['length of pieces [m]']:.1f} m |",
    ]
