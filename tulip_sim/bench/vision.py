"""Vision on random scenes with the camera pose that the robot has, its speed, and its answers to real pictures."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_sim.bench.runner import Bench, Row
from tulip_sim.bench.vision_goals import GoalCounts, count_goals
from tulip_sim.bench.vision_picture import draw_scenes
from tulip_sim.bench.vision_real import draw_real, measure_real, real_table
from tulip_sim.bench.vision_score import LINE_LIMITS, Judge
from tulip_sim.bench.vision_shots import shots, vision_of
from tulip_sim.bench.vision_speed import measure_speed, speed_table
from tulip_sim.bench.vision_tables import scenes_table
from tulip_vision.lens import head_camera_lens
from tulip_vision.pipeline import Vision

SEEDS = 50  # robots, each of which takes ten pictures
REAL_PICTURES = Path(__file__).resolve().parents[2] / "build" / "vision_real.png"
FASTEST = 6.0  # [ms] median of all stages that is asked for


def measure_scenes(seed: int) -> Row:
    """Let one robot take its pictures and vision look at them."""
    cv2.setNumThreads(1)
    lens = head_camera_lens()
    judge = Judge(lens, load_field(), load_robot())
    sightings: list[str] = []
    lines = {"believed": [np.empty(0)], "own": [np.empty(0)]}
    border = [np.empty(0)]
    goals = GoalCounts()
    pictures, brightness = 0, 0.0
    vision: Vision | None = None
    for shot in shots(seed):
        vision = vision or vision_of(shot)  # one robot has one camera
        features = vision.process(shot.picture, shot.stamp, shot.believed)
        goals += count_goals(features.features, judge.things(shot)["post"], shot.true[:3, 3])
        sightings += [each.to_text() for each in judge.sightings(shot, pictures, features)]
        errors = judge.line_errors(shot, features)
        lines["believed"].append(errors.believed)
        lines["own"].append(errors.own)
        border.append(judge.border_errors(shot, features))
        pictures, brightness = pictures + 1, shot.camera.brightness
    row: Row = {"part": "scenes", "seed": seed, "pictures": pictures, "brightness": round(brightness, 3)}
    for name, parts in lines.items():
        values = np.concatenate(parts)
        row[f"line points, {name}"] = [len(values), *(int((values < limit).sum()) for limit in LINE_LIMITS)]
    values = np.concatenate(border)
    row["border points"] = [len(values), *(int((values < limit).sum()) for limit in LINE_LIMITS)]
    return {**row, "goals": vars(goals), "sightings": sightings}


def measure(part: str, seed: int) -> Row:
    """Measure one part."""
    if part == "speed":
        return measure_speed()
    return measure_real() if part == "real" else measure_scenes(seed)


def summarize(rows: list[Row]) -> list[str]:
    """Return the tables of all parts."""
    lines: list[str] = []
    scenes = _part(rows, "scenes")
    if scenes:
        lines += scenes_table(scenes)
    for row in _part(rows, "speed"):
        lines += ["", *speed_table(row, FASTEST)]
    for row in _part(rows, "real"):
        lines += ["", *real_table(row)]
    return lines


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw good and bad pictures of the scenes; and one of the real pictures, which are not ours to publish."""
    draw_scenes(_part(rows, "scenes"), path)
    draw_real(REAL_PICTURES)


def _part(rows: Sequence[Row], part: str) -> list[Row]:
    return [row for row in rows if row["part"] == part]


TRIALS = [("speed", 0), ("real", 0), *(("scenes", seed) for seed in range(SEEDS))]
BENCH = Bench("vision", "Vision", TRIALS, measure, summarize, draw, workers=1)  # one part measures time
