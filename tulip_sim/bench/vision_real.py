"""Vision on pictures that no simulator made: other robots, halls and lenses, from ../shared/data/real_images."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Sequence
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
from tulip_vision.segmentation import ColourBox, SegmentationParameters
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
            size = feature.angular_radius
            if math.isnan(size):  # seen in part: as large as a ball at its place
                ball = parameters.ball.radius
                size = math.asin(min(1.0, ball * math.sin(-feature.elevation) / (vision.last.view.height - ball)))
            balls.append(Found(u, v, size / vision.last.view.angle_per_pixel(direction)))
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

    scenes = list(yellow_scenes())
    for name, lens, pose, _ in scenes:
        _, balls = see(name, lens, pose, VisionParameters())
        claims += [name] * len(balls)
    row["orange balls claimed where there is none"] = claims
    row["yellow balls"] = len(scenes)
    rules = VisionParameters().segmentation.colours.yellow
    row["yellow by the rules"] = _find_yellow(scenes, rules)
    # A robot's colours are calibrated where it plays: here on one half of the pictures, for the other half.
    halves = scenes[::2], scenes[1::2]
    found = [_find_yellow(test, ball_colour(learn)) for test, learn in (halves, halves[::-1])]
    row["yellow calibrated"] = {
        "found": sum(each["found"] for each in found),
        "false": sum(each["false"] for each in found),
        "missed in": [name for each in found for name in each["missed in"]],
    }
    return row


Scene = tuple[str, Lens, Array, Found]


def ball_colour(scenes: Sequence[Scene]) -> ColourBox:
    """Return the colours that the balls of some pictures have: from the 10th to the 90th percentile."""
    pixels = []
    for name, _, _, ball in scenes:
        picture = np.asarray(cv2.imread(str(FOLDER / name)), np.uint8)
        v, u = np.mgrid[: picture.shape[0], : picture.shape[1]]
        inner = picture[np.hypot(u - ball.u, v - ball.v) < max(0.6 * ball.radius, 1.5)]
        hsv = cv2.cvtColor(inner[None], cv2.COLOR_BGR2HSV)[0].astype(float)
        pixels.append(hsv[:: max(len(hsv) // 30, 1)])  # large balls count like small ones
    hue, saturation, value = np.concatenate(pixels).T
    (low, high), least, dark = (
        np.percentile(hue, [10, 90]) * 2.0,
        np.percentile(saturation, 10),
        np.percentile(value, 10),
    )
    return ColourBox((float(low), float(high)), (float(least) / 255.0, 1.0), (float(dark) / 255.0, 1.0))


def _find_yellow(scenes: Sequence[Scene], colour: ColourBox) -> dict[str, Any]:
    """Look for yellow balls of a colour; return how many are found, how many false ones, and where one is missed."""
    colours = replace(VisionParameters().segmentation.colours, orange=colour)
    parameters = VisionParameters(
        ball=BallParameters(radius=YELLOW_RADIUS), segmentation=SegmentationParameters(colours=colours)
    )
    found, false, missed = 0, 0, []
    for name, lens, pose, ball in scenes:
        _, balls = see(name, lens, pose, parameters)
        hit = sum(math.hypot(each.u - ball.u, each.v - ball.v) < ball.radius for each in balls)
        found += min(hit, 1)
        false += len(balls) - hit
        missed += [] if hit else [name]
    return {"found": found, "false": false, "missed in": missed}


def draw_real(path: Path) -> None:
    """Draw what vision sees in the pictures with known lens and pose, and every ball that it claims in them, closer.

    Args:
        path: Of the PNG file; nothing is written where the pictures are not.
    """
    try:
        entries = [entry for entry in manifest() if "lens" in entry["annotation"]]
    except OSError:
        return
    path.parent.mkdir(parents=True, exist_ok=True)
    whole, close = [], []
    for entry in entries:
        lens, pose = known_lens(entry)
        vision, balls = see(entry["file"], lens, pose, VisionParameters())
        assert vision.last is not None
        drawn = vision.annotate(np.asarray(cv2.imread(str(FOLDER / entry["file"])), np.uint8), vision.last.features)
        whole.append(np.asarray(cv2.resize(drawn, (320, 256), interpolation=cv2.INTER_AREA), np.uint8))
        for ball in balls:
            corner = int(np.clip(ball.u - 80, 0, lens.width - 160)), int(np.clip(ball.v - 64, 0, lens.height - 128))
            part = drawn[corner[1] : corner[1] + 128, corner[0] : corner[0] + 160]
            close.append(np.asarray(cv2.resize(part, (320, 256), interpolation=cv2.INTER_NEAREST), np.uint8))
    tiles = whole + close
    tiles += [np.zeros_like(tiles[0])] * (-len(tiles) % 4)
    rows = [np.hstack(tiles[first : first + 4]) for first in range(0, len(tiles), 4)]
    cv2.imwrite(str(path), np.bitwise_and(np.vstack(rows), np.uint8(0xF8)))


def real_table(row: Row) -> list[str]:
    """Return the figures as markdown."""
    lines = ["### Real pictures", ""]
    if "skipped" in row:
        return [*lines, f"Left out: {row['skipped']}."]
    claims = row["orange balls claimed where there is none"]
    rules, fitted = (
        f"recall {each['found']} of {row['yellow balls']}, precision {each['found']} of {each['found'] + each['false']}"
        for each in (row["yellow by the rules"], row["yellow calibrated"])
    )
    share = row["of that along the field's two directions [m]"] / max(row["length of pieces [m]"], 1e-9)
    return [
        *lines,
        "| what | asked for | came out |",
        "| --- | --- | --- |",
        f"| orange balls of 2012 found | all | {row['orange balls found']} of {row['orange balls']} |",
        f"| orange balls claimed where there is none | 0 | {len(claims)}{': ' if claims else ''}{', '.join(claims)} |",
        f"| red balls claimed as orange (right or wrong as one likes) | |"
        f" {row['red balls claimed as orange']} in {row['pictures with red balls']} pictures |",
        f"| yellow balls among people, robots and shirts, lens and pose guessed; the ball's colour as the rules' yellow"
        f" | | {rules} |",
        f"| the same, the ball's colour calibrated on the other half of the pictures | | {fitted} |",
        f"| pieces of line in {row['of them with two or more pieces of line']} of {row['pictures with known lens']}"
        " pictures with known lens and pose that, on the ground, keep to two directions at a right angle within 3 deg"
        f" | | {share:.1%} of {row['length of pieces [m]']:.1f} m |",
    ]
