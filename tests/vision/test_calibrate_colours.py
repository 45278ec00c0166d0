"""scripts/calibrate.py colours: classes in the light of a hall that the default boxes do not know."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import calibrate
import cv2
import numpy as np
import pytest
import yaml
from test_segmentation import looking_down
from typer.testing import CliRunner
from vision_evaluation import random_scenes, truth_of

from tulip_description.field import load_field
from tulip_description.robot import load_robot
from tulip_sim.camera import CameraParameters, CameraRenderer
from tulip_vision.calibration.colour_fit import draw_classes, fit_colours, segmentation_parameters
from tulip_vision.colour_file import CLASSES, ColourFileError, read_colours, write_colours
from tulip_vision.lens import head_camera_lens
from tulip_vision.segmentation import Colour, ColourBoxes, SegmentationParameters, Segmenter

BLUISH = CameraParameters(blue_gain=1.4, red_gain=0.75, brightness=0.8)
REDDISH = CameraParameters(blue_gain=0.85, red_gain=1.15, brightness=0.9)


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(calibrate.app, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


def painted(light: CameraParameters, seed: int, count: int = 4) -> list[tuple[np.ndarray, dict[str, np.ndarray]]]:
    """Return pictures in a hall's light, each with where things really are: told apart in neutral light without noise.

    A thing's middle only, since its edges are of no class.
    """
    field, robot, lens = load_field(), load_robot(), head_camera_lens()
    plain = CameraParameters(flicker=0.0, vignetting=0.0, blur=0.0, noise=0.0)
    taken, true = (CameraRenderer(parameters, field, robot, lens) for parameters in (light, plain))
    found = []
    for scene in random_scenes(count, field, robot, np.random.default_rng(seed)):
        picture = taken.render(truth_of(scene), np.random.default_rng(seed))
        neutral = true.render(truth_of(scene), np.random.default_rng(0))
        classes = Segmenter(SegmentationParameters()).segment(neutral, looking_down(lens, 0.5)).classes
        areas = {}
        for name in ("green", "white", "orange", "yellow", "magenta"):
            whole = ((classes & Colour[name.upper()]) != 0).astype(np.uint8)
            areas[name] = cv2.erode(whole, np.ones((5, 5), np.uint8)) != 0
        for area in areas.values():
            area[: field_top(areas["green"])] = False  # what hangs on the walls is of no class
        found.append((picture, areas))
    return found


def field_top(green: np.ndarray) -> int:
    rows = np.flatnonzero(green.mean(axis=1) > 0.3)
    return int(rows[0]) if len(rows) else len(green)


def recalls(scenes: list[tuple[np.ndarray, dict[str, np.ndarray]]], parameters: SegmentationParameters) -> dict:
    """Return by class the share of its pixels that segmentation finds, over all pictures."""
    view, hits, all_ = looking_down(head_camera_lens(), 0.5), dict.fromkeys(CLASSES, 0), dict.fromkeys(CLASSES, 0)
    for picture, areas in scenes:
        classes = Segmenter(parameters).segment(picture, view).classes
        for name, area in areas.items():
            hits[name] += int(((classes[area] & Colour[name.upper()]) != 0).sum())
            all_[name] += int(area.sum())
    return {name: hits[name] / all_[name] for name in CLASSES if all_[name] > 100}


def spot(area: np.ndarray) -> tuple[int, int]:
    """Return u, v of the place deepest inside an area."""
    depth = cv2.distanceTransform(area.astype(np.uint8), cv2.DIST_L2, 3)
    v, u = np.unravel_index(int(depth.argmax()), area.shape)
    return int(u), int(v)


def test_a_click_on_each_thing_gives_classes_that_hold_in_other_pictures(tmp_path: Path) -> None:
    known, others = painted(BLUISH, seed=3, count=6), painted(BLUISH, seed=11, count=12)
    names, labels = [], []
    for index, (picture, areas) in enumerate(known):
        names.append(tmp_path / f"p{index}.png")
        cv2.imwrite(str(names[-1]), picture)
        for name, area in areas.items():
            if area.sum() > 30:
                u, v = spot(area)
                labels += ["--label", f"{name}@{index + 1}:{u},{v}"]
    output = tmp_path / "colours.yaml"
    code, text = run("colours", *names, *labels, "--output", output)
    assert code == 0, text
    fitted = segmentation_parameters(read_colours(output))
    before, after = recalls(others, SegmentationParameters()), recalls(others, fitted)
    assert set(after) >= {"green", "white", "orange", "yellow", "magenta"}
    assert min(before["white"], before["yellow"], before["magenta"]) < 0.3
    for name in ("green", "white", "orange", "yellow", "magenta"):
        assert after[name] > 0.9, (name, before, after)
    # No class takes the carpet: at most one of its pixels in a hundred.
    for picture, areas in others:
        classes = Segmenter(fitted).segment(picture, looking_down(head_camera_lens(), 0.5)).classes[areas["green"]]
        assert ((classes & ~np.uint8(Colour.GREEN | Colour.DARK)) != 0).mean() < 0.01
    drawing = cv2.imread(str(output.with_suffix(".png")))
    assert drawing.shape == (3 * 480, 3 * 640 + 16, 3)


def test_without_labels_the_classes_follow_the_light() -> None:
    known, others = painted(REDDISH, seed=3, count=8), painted(REDDISH, seed=11, count=10)
    fit = fit_colours({str(index): picture for index, (picture, _) in enumerate(known)}, {})
    assert {"green", "white", "orange", "yellow", "magenta"} <= set(fit.used)
    before, after = recalls(others, SegmentationParameters()), recalls(others, segmentation_parameters(fit.colours))
    assert before["white"] < 0.85 < 0.95 < after["white"], (before, after)
    for name in before:
        assert after[name] > min(before[name], 0.95) - 0.02, (name, before, after)


def test_without_labels_no_class_grows_into_other_things() -> None:
    scenes = painted(CameraParameters(), seed=5, count=3)
    # Brown boxes on the carpet, whose edges shade off into the orange of a ball: light that a ball may not follow.
    pictures = {}
    for index, (picture, _) in enumerate(scenes):
        picture[300:420, 100:400] = np.linspace((20, 100, 230), (70, 85, 105), 300).astype(np.uint8)
        pictures[str(index)] = picture
    fit = fit_colours(pictures, {})
    known = read_colours()
    for name in CLASSES:
        assert fit.after[name] <= 2.0 * fit.before[name] + 100, name
        if name not in fit.used and name not in ("orange", "yellow", "cyan", "blue"):  # whose neighbours may trim them
            assert fit.colours.boxes[name] == known.boxes[name]
    assert fit.colours.boxes["orange"]["saturation"][0] >= known.boxes["orange"]["saturation"][0] - 0.11


def test_labels_may_stand_in_a_file_and_other_classes_stay(tmp_path: Path) -> None:
    picture, areas = painted(BLUISH, seed=3, count=1)[0]
    path, labels, output = tmp_path / "p.png", tmp_path / "labels.yaml", tmp_path / "colours.yaml"
    cv2.imwrite(str(path), picture)
    u, v = spot(areas["orange"])
    labels.write_text(yaml.safe_dump({"p.png": {"orange": [[u - 5, v - 5, 11, 11]]}}))
    code, text = run("colours", path, "--labels", labels, "--output", output)
    assert code == 0, text
    found, known = read_colours(output), read_colours()
    assert found.boxes["orange"] != known.boxes["orange"]
    assert all(found.boxes[name] == known.boxes[name] for name in ("green", "white", "blue", "dark"))
    assert draw_classes(picture, found)[v, u].tolist() == [0, 120, 255]


def test_defaults_are_those_of_the_file_and_files_are_read_again(tmp_path: Path) -> None:
    known = read_colours()
    assert known.boxes["green"] == {"hue": (68.0, 170.0), "saturation": (0.25, 1.0), "value": (0.12, 1.0)}
    assert segmentation_parameters(known) == SegmentationParameters()
    assert tuple(vars(ColourBoxes())) == CLASSES
    write_colours(tmp_path / "c.yaml", known, ["note: this"])
    assert read_colours(tmp_path / "c.yaml") == known


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("green:", "gren:", "has the colours gren"),
        ("[68.0, 170.0]", "[68.0]", "green.hue is .*expected two numbers"),
        ("[68.0, 170.0]", "[low, 170.0]", "green.hue is 'low'; expected a finite number"),
        ("value: [0.12, 1.0]", "valu: [0.12, 1.0]", "expected hue, saturation, value"),
        ("reference_brightness: 0.5", "reference_brightness: 2.0", "expected above 0 to 1"),
        ("ros__parameters", "parameters", "is no colour file"),
        ("vision:", "vision: [", "is not YAML"),
    ],
)
def test_colour_files_that_cannot_be_used_are_named(tmp_path: Path, old: str, new: str, words: str) -> None:
    write_colours(tmp_path / "c.yaml", read_colours())
    text = (tmp_path / "c.yaml").read_text()
    assert old in text
    (tmp_path / "c.yaml").write_text(text.replace(old, new))
    with pytest.raises(ColourFileError, match=words):
        read_colours(tmp_path / "c.yaml")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--label", "orage:100,100,20,20"], "no colour class 'orage'"),
        (["--label", "orange:630,100,20,20"], "rectangle 630,100,20,20 of orange is not inside"),
        (["--label", "orange:100"], "--label is 'orange:100'"),
        (["--label", "orange@2:100,100"], "is of picture 2; expected 1 to 1"),
        (["--label", "green:100,300,3,3"], "the labels of green have 9 px; expected at least"),
        (["--label", "orange:100,20,30,30"], "the labels of orange are mostly grey"),
        (["--label", "green:100,300,40,40", "--label", "yellow:300,300,40,40"], "can be kept apart from other classes"),
        (["--label", "orange:700,100"], "rectangle 700,100,1,1 of orange is not inside"),
        (["--labels", "none.yaml"], "none.yaml cannot be read"),
        (["--labels", "list.yaml"], "is not as expected, picture:"),
        (["--labels", "other.yaml"], "labels are given for other.png"),
        (["--start", "list.yaml"], "list.yaml is no colour file"),
        (["--output", "none/c.yaml"], "--output none/c.yaml cannot be written"),
    ],
)
def test_what_cannot_be_used_is_told_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    picture = np.full((480, 640, 3), 120, np.uint8)
    picture[200:] = (44, 128, 58)
    cv2.imwrite("p.png", picture)
    Path("list.yaml").write_text("[1, 2]")
    Path("other.yaml").write_text("other.png: {orange: [[1, 1, 9, 9]]}")
    code, text = run("colours", "p.png", *arguments)
    lines = [line for line in text.splitlines() if line.startswith("error: ")]
    assert code == 2, text
    assert len(lines) == 1 and words in lines[0], text
    assert not Path("colours.yaml").exists()


def test_pictures_without_carpet_need_labels(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    cv2.imwrite("grey.png", np.full((480, 640, 3), 120, np.uint8))
    Path("text.png").write_text("none")
    for name, words in (("grey.png", "No class was found on a carpet"), ("text.png", "is none that can be read")):
        code, text = run("colours", name)
        assert code == 2 and words in text, text


def test_a_colour_file_that_cannot_be_used_is_told_in_one_line_by_every_script(tmp_path: Path) -> None:
    (tmp_path / "colours.yaml").write_text("vision: {}")
    code = (
        "import _environment; _environment.prepare(); from pathlib import Path;"
        f" from tulip_vision.colour_file import read_colours; read_colours(Path({str(tmp_path / 'colours.yaml')!r}))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "TULIP_NO_VENV": "1"},
        cwd=Path(calibrate.__file__).parent,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"error: {tmp_path / 'colours.yaml'} is no colour file")
