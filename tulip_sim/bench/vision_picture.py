"""The picture of bench vision: what vision drew into its pictures, where it did well and where it did worst."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from tulip_sim.bench.runner import Row
from tulip_sim.bench.vision_score import Sighting
from tulip_sim.bench.vision_shots import shots, vision_of
from tulip_sim.bench.vision_tables import RANGES

EACH = 4  # good pictures, and bad ones
COLUMNS = 4
SCALE = 0.75  # of the frames
KEPT = np.uint8(0xF8)  # bits of a colour: the others are the camera's noise, and half of the file
TITLE_HEIGHT = 22  # [px]


def draw_scenes(rows: Sequence[Row], path: Path) -> None:
    """Draw good pictures, from different robots, and then the worst ones, with what is wrong in their titles.

    Args:
        rows: Of the scenes.
        path: Of the PNG file.
    """
    good: list[tuple[int, int, int]] = []  # number of things found, seed, picture
    bad: list[tuple[int, int, int, str]] = []  # number of errors, seed, picture, what is wrong
    for row in rows:
        by_picture: dict[int, list[Sighting]] = {}
        for text in row["sightings"]:
            sighting = Sighting.from_text(text)
            by_picture.setdefault(sighting.picture, []).append(sighting)
        best = (0, 0, 0)
        for picture, seen in by_picture.items():
            wrong = [each for each in seen if _wrong(each)]
            if wrong:
                bad.append((len(wrong), row["seed"], picture, "; ".join(_words(each) for each in wrong)))
            else:
                best = max(best, (len({each.kind for each in seen if each.found}), row["seed"], picture))
        good.append(best)
    good.sort(reverse=True)
    bad.sort(reverse=True)
    chosen = [(seed, picture, "all found") for _, seed, picture in good[:EACH]]
    chosen += [(seed, picture, words) for _, seed, picture, words in bad[:EACH]]
    frames = [_frame(*each) for each in chosen]
    if not frames:
        return
    frames += [np.zeros_like(frames[0])] * (-len(frames) % COLUMNS)
    sheet = [np.hstack(frames[first : first + COLUMNS]) for first in range(0, len(frames), COLUMNS)]
    cv2.imwrite(str(path), np.vstack(sheet))


def _wrong(sighting: Sighting) -> bool:
    missed = sighting.state == "whole" and not sighting.found and sighting.distance <= RANGES[sighting.name]
    return missed or sighting.state == "false"


def _words(sighting: Sighting) -> str:
    kind = sighting.kind.lower()
    return f"false {kind}" if sighting.state == "false" else f"missed {kind} at {sighting.distance:.1f} m"


def _frame(seed: int, number: int, words: str) -> NDArray[np.uint8]:
    """Take a picture once more and let vision draw into it."""
    shot = next(islice(shots(seed), number, None))
    vision = vision_of(shot)
    drawn = vision.annotate(shot.picture, vision.process(shot.picture, shot.stamp, shot.believed))
    small = np.bitwise_and(cv2.resize(drawn, None, fx=SCALE, fy=SCALE, interpolation=cv2.INTER_AREA), KEPT)
    frame = cv2.copyMakeBorder(small, TITLE_HEIGHT, 0, 0, 0, cv2.BORDER_CONSTANT)
    title = f"seed {seed}, picture {number}, {shot.movement}, {shot.exposure} ms: {words}"
    cv2.putText(frame, title[:74], (4, 16), cv2.FONT_HERSHEY_SIMPLEX, 0.38, (255, 255, 255), 1, cv2.LINE_AA)
    return np.asarray(frame, np.uint8)
