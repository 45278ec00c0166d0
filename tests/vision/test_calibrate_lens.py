"""scripts/calibrate.py lens and render: the lens that took the pictures is found again."""

from __future__ import annotations

from pathlib import Path

import calibrate
import cv2
import numpy as np
import pytest
from typer.testing import CliRunner

from tulip_vision.calibration.board_pictures import BoardCamera, PictureParameters, independent_rays, spots
from tulip_vision.calibration.boards import Board, Corners
from tulip_vision.calibration.lens_fit import FitError, fit_lens
from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.lens_file import read_lens

FISHEYE_MATRIX = [[330.0, 0.0, 322.0], [0.0, 331.0, 238.0], [0.0, 0.0, 1.0]]


def run(*arguments: object) -> tuple[int, str]:
    result = CliRunner().invoke(calibrate.app, [str(argument) for argument in arguments])
    assert result.exception is None or isinstance(result.exception, SystemExit), result.exception
    return result.exit_code, result.output


def ray_errors(found: Lens, true: Lens) -> np.ndarray:
    """Return the angles between what pixels all over the picture see by the one and the other [deg]."""
    v, u = np.mgrid[0 : true.height : 8, 0 : true.width : 8]
    pixels = np.stack([u.ravel(), v.ravel()], axis=1).astype(float)
    cosines = (found.rays(pixels) * independent_rays(true, pixels)).sum(axis=1)
    return np.degrees(np.arccos(np.clip(cosines, -1.0, 1.0)))


@pytest.fixture(scope="module")
def boards(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("calibration") / "boards"
    assert run("render", folder, "--pictures", 13, "--seed", 3)[0] == 0
    return folder


def test_the_head_cameras_lens_and_model_are_found_and_a_bad_picture_is_named(boards: Path, tmp_path: Path) -> None:
    pictures = sorted(boards.glob("board*.png"))
    (tmp_path / "wall.png").write_bytes(cv2.imencode(".png", np.full((480, 640), 128, np.uint8))[1].tobytes())
    output = tmp_path / "lens.yaml"
    code, text = run("lens", *pictures, tmp_path / "wall.png", "--output", output)
    assert code == 0, text
    assert "no board found in it" in " ".join(text.split())
    lens = read_lens(output, (640, 480))
    assert lens.model == "plumb_bob"  # chosen among five
    assert ray_errors(lens, head_camera_lens()).max() < 0.2
    drawing = cv2.imread(str(output.with_suffix(".png")))
    assert drawing.shape == (480, 640 + 8 + 640, 3)


@pytest.mark.parametrize(
    ("kind", "true", "model"),
    [
        ("charuco", Lens(640, 480, FISHEYE_MATRIX, [-0.01, 0.002, 0.0, 0.0], "fisheye"), "equidistant"),
        ("chessboard", Lens(640, 480, FISHEYE_MATRIX, [], "equisolid"), "equisolid"),
        ("charuco", Lens(640, 480, [[455.0, 0, 320], [0, 455, 240], [0, 0, 1]], [], "rectilinear"), "rectilinear"),
    ],
)
def test_each_model_is_found_from_either_board(kind: str, true: Lens, model: str) -> None:
    board, rng = Board(kind), np.random.default_rng(5)
    camera = BoardCamera(true, board, PictureParameters())
    pictures = {str(index): camera.take(spot, rng) for index, spot in enumerate(spots(13))}
    corners = {name: found for name, picture in pictures.items() if (found := board.find(picture)) is not None}
    assert len(corners) >= 12
    fit = fit_lens(corners, (640, 480), model)
    assert 0.02 < fit.error < 0.3
    assert not fit.left_out
    assert ray_errors(fit.lens, true).max() < 0.2


def corners_of(count: int, rng: np.random.Generator, tilt: float = 0.5) -> dict[str, Corners]:
    """Return noisy corners as OpenCV projects them."""
    row, column = np.mgrid[1:7, 1:9]
    points = np.stack([column.ravel(), row.ravel(), 0.0 * row.ravel()], axis=1) * 0.03
    lens, found = head_camera_lens(), {}
    for index in range(count):
        turn = np.append(rng.uniform(-tilt, tilt, 2), 0.1)
        place = np.append(rng.uniform(-0.15, 0.05, 2), 0.5)
        pixels, _ = cv2.projectPoints(points, turn, place, np.array(lens.camera_matrix), np.array(lens.distortion))
        found[f"{index}.png"] = Corners(points, pixels.reshape(-1, 2) + 0.1 * rng.standard_normal((len(points), 2)))
    return found


def test_spreads_are_those_of_repeated_calibrations_and_agree_with_opencv() -> None:
    numbers, spreads = [], []
    for seed in range(7):
        corners = corners_of(8, np.random.default_rng(seed))
        fit = fit_lens(corners, (640, 480), "plumb_bob")
        numbers.append(fit.lens.camera_matrix[[0, 1], [0, 2]])
        spreads.append(fit.spread[[0, 3]])
        points = [each.points.astype(np.float32) for each in corners.values()]
        pixels = [each.pixels.astype(np.float32) for each in corners.values()]
        error, matrix, *_ = cv2.calibrateCamera(points, pixels, (640, 480), None, None)
        assert fit.error == pytest.approx(error, rel=0.02)
        assert np.abs(matrix - fit.lens.camera_matrix).max() < 2.0 * fit.spread.max()
    missed = (np.array(numbers) - [455.0, 238.0]) / np.array(spreads)
    assert 0.4 < np.sqrt((missed[:, 0] ** 2).mean()) < 2.0


def test_a_picture_with_wrong_corners_is_left_out_with_the_reason() -> None:
    corners = corners_of(8, np.random.default_rng(1))
    wrong = corners["3.png"]
    corners["3.png"] = Corners(wrong.points, wrong.pixels + [6.0, 0.0] * (wrong.points[:, :1] > 0.12))
    fit = fit_lens(corners, (640, 480), "plumb_bob")
    assert list(fit.left_out) == ["3.png"]
    assert "miss by" in fit.left_out["3.png"]
    assert ray_errors(fit.lens, head_camera_lens()).mean() < 0.3


def test_boards_that_all_face_the_camera_do_not_tell_the_focal_length() -> None:
    with pytest.raises(FitError, match="focal length stays unknown"):
        fit_lens(corners_of(6, np.random.default_rng(1), tilt=1e-3), (640, 480), "plumb_bob")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, shape in (("a", (480, 640)), ("b", (480, 640)), ("c", (480, 640)), ("d", (480, 640)), ("e", (240, 320))):
        cv2.imwrite(f"{name}.png", np.full(shape, 100, np.uint8))
    Path("text.png").write_text("no picture")
    Path("bad.yaml").write_text("a: 1")
    Path("full").mkdir()
    Path("full/kept").write_text("kept")
    return tmp_path


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["lens", "a.png"], "too few pictures, 1; expected at least 4"),
        (["lens", "a.png", "b.png", "c.png", "d.png"], "was found in 0 of 4 pictures"),
        (["lens", "a.png", "b.png", "c.png", "e.png"], "e.png has 320 x 240 px, a.png has 640 x 480 px"),
        (["lens", "a.png", "b.png", "c.png", "text.png"], "text.png is none that can be read"),
        (["lens", "a.png", "b.png", "c.png", "none.png"], "none.png cannot be read: No such file"),
        (["lens", "a.png", "b.png", "c.png", "d.png", "--model", "equisold"], "Did you mean equisolid"),
        (["lens", "a.png", "b.png", "c.png", "d.png", "--squares", "9"], "--squares is '9'"),
        (["lens", "a.png", "b.png", "c.png", "d.png", "--board", "charucco"], "Did you mean charuco"),
        (["lens", "a.png", "b.png", "c.png", "d.png", "--output", "none/l.yaml"], "--output none/l.yaml cannot"),
        (["render", "full"], "Folder full is not empty"),
        (["render", "new", "--lens", "bad.yaml"], "bad.yaml: lacks image_width"),
        (["render", "new", "--squares", "3x3"], "expected 4 to 20 each way"),
    ],
)
def test_what_cannot_be_used_is_told_in_one_line(folder: Path, arguments: list[str], words: str) -> None:
    before = sorted(folder.rglob("*"))
    code, text = run(*arguments)
    lines = [line for line in text.splitlines() if line.startswith("error: ")]
    assert code == 2
    assert len(lines) == 1 and words in lines[0], text
    assert "Traceback" not in text
    assert sorted(folder.rglob("*")) == before
