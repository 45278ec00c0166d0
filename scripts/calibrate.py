"""Calibrate: lens, camera mount and colour classes from pictures."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import math
import re
from pathlib import Path
from typing import Annotated

import cv2
import numpy as np
import typer
from _calibration_io import Picture, make_folder, progress_bar, read_picture, read_pictures, told, track
from rich.console import Console
from rich.table import Table

from tulip_description.camera_mount import MOUNT_FILE, OFFSETS, MountOffsets, load_mount, write_mount
from tulip_description.field import load_field
from tulip_description.planar import Pose2D
from tulip_description.robot import load_robot
from tulip_description.yaml_file import read_yaml
from tulip_ros.errors import BadInputError, check_writable, unknown
from tulip_vision.calibration.board_pictures import BoardCamera, PictureParameters, spots
from tulip_vision.calibration.boards import CHARUCO, CHESSBOARD, Board, Corners
from tulip_vision.calibration.colour_fit import (
    ColourFit,
    Rectangle,
    check_labels,
    draw_classes,
    fit_colours,
    segmentation_parameters,
)
from tulip_vision.calibration.lens_fit import COEFFICIENTS, FEWEST_PICTURES, LensFit, choose_model, fit_lens
from tulip_vision.calibration.mount_fit import FITTED, MountCalibration, MountFit
from tulip_vision.calibration.recording import LENS, read_recording, write_recording
from tulip_vision.calibration.straighten import beside, draw_corners, straighten
from tulip_vision.colour_file import PATH as COLOURS_FILE
from tulip_vision.colour_file import ColourFile, read_colours, write_colours
from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.lens_file import read_lens, write_lens

AUTO = "auto"
CLICK = 7  # [px] edge of the square that a click labels

app = typer.Typer(help=__doc__, add_completion=False, no_args_is_help=True)

KIND = Annotated[str, typer.Option("--board", help=f"{CHESSBOARD} or {CHARUCO}.")]
SQUARES = Annotated[str, typer.Option(help="Number of squares, not of corners, as in 9x7.")]
SQUARE = Annotated[float, typer.Option("--square", help="Edge of a square [m].")]


@app.command()
@told
def lens(
    pictures: Annotated[
        list[Path], typer.Argument(help="Pictures of the board, from all sides, all over the picture.")
    ],
    kind: KIND = CHESSBOARD,
    squares: SQUARES = "9x7",
    square: SQUARE = 0.03,
    model: Annotated[str, typer.Option(help=f"{AUTO} or one of {', '.join(COEFFICIENTS)}.")] = AUTO,
    output: Annotated[Path, typer.Option(help="Lens file to write.")] = Path("lens.yaml"),
) -> None:
    """Find the lens from pictures of a chessboard or ChArUco board."""
    board = make_board(kind, squares, square)
    if model != AUTO and model not in COEFFICIENTS:
        raise unknown("lens model", model, [AUTO, *COEFFICIENTS])
    check_writable(output, "--output")
    if len(pictures) < FEWEST_PICTURES:
        raise BadInputError(f"too few pictures, {len(pictures)}; expected at least {FEWEST_PICTURES}.")
    seen = read_pictures(pictures)
    console = Console()
    size, corners = find_boards(seen, board, console)
    missing = {name: "no board found in it" for name in seen if name not in corners}
    if len(corners) < FEWEST_PICTURES:
        raise BadInputError(
            f"A {kind} of {squares} squares was found in {len(corners)} of {len(seen)} pictures; expected at least"
            f" {FEWEST_PICTURES}. Check --board and --squares, and that the whole board with its white rim is seen."
        )
    names = list(COEFFICIENTS) if model == AUTO else [model]
    fits, failed = [], ""
    for name in track(names, "fitting", console):
        try:
            fits.append(fit_lens(corners, size, name))
        except ValueError as error:
            failed = str(error)
    if not fits:
        raise BadInputError(f"No lens fits: {failed}.")
    best = choose_model(fits)
    report_lens(best, fits, missing, console)
    write_lens(
        output,
        best.lens,
        provenance=[
            f"Written by scripts/calibrate.py lens: {best.model} from {len(best.errors)} pictures of a {kind} with"
            f" {squares} squares of {square:g} m;",
            f"corners are met within {best.error:.3f} px (RMS).",
        ],
    )
    drawing = output.with_suffix(".png")
    name = max(best.errors, key=lambda each: spread_over(corners[each], size))
    fitted = best.projected(name, corners[name])
    before = draw_corners(seen[name], corners[name].pixels, fitted)
    cv2.imwrite(str(drawing), beside(before, straighten(before, best.lens)))
    console.print(f"Wrote {output} and {drawing} ({name}, before and after)", soft_wrap=True, highlight=False)


@app.command()
@told
def render(
    folder: Annotated[Path, typer.Argument(help="New folder for the pictures and the lens file.")],
    count: Annotated[int, typer.Option("--pictures", help="How many.", min=1, max=200)] = 13,
    kind: KIND = CHESSBOARD,
    squares: SQUARES = "9x7",
    square: SQUARE = 0.03,
    lens_file: Annotated[Path | None, typer.Option("--lens", help="Lens file; none: the head camera.")] = None,
    blur: Annotated[float, typer.Option(help="Standard deviation [px].")] = 0.7,
    noise: Annotated[float, typer.Option(help="Standard deviation [grey levels].")] = 4.0,
    seed: Annotated[int, typer.Option(help="Of poses and noise.", min=0)] = 1,
) -> None:
    """Render pictures of a board as a camera with a known lens takes them, for trying out `lens`."""
    board, parameters = make_board(kind, squares, square), PictureParameters(blur, noise)
    taken_by: Lens = head_camera_lens() if lens_file is None else read_lens(lens_file)
    make_folder(folder)
    camera, rng = BoardCamera(taken_by, board, parameters), np.random.default_rng(seed)
    console = Console()
    for index, spot in enumerate(track(spots(count), "rendering", console)):
        cv2.imwrite(str(folder / f"board{index:03d}.png"), camera.take(spot, rng))
    write_lens(folder / "true_lens.yaml", taken_by, provenance=["The lens that rendered the pictures beside it."])
    console.print(
        f"Wrote {count} pictures. Next: calibrate.py lens {folder}/*.png --board {kind} --squares {squares}"
        f" --square {square:g}",
        soft_wrap=True,
        highlight=False,
    )


@app.command()
@told
def record(
    folder: Annotated[Path, typer.Argument(help="New folder for the pictures and recording.yaml.")],
    x: Annotated[float, typer.Option(help="Where the robot stands in map [m].")] = 1.2,
    y: Annotated[float, typer.Option(help="[m]")] = 0.6,
    yaw: Annotated[float, typer.Option(help="[deg]")] = 10.0,
    angle: Annotated[float, typer.Option(help="The camera's mount errs by up to this [deg].")] = 2.0,
    height: Annotated[float, typer.Option(help="And in height by up to this [m].")] = 0.01,
    seed: Annotated[int, typer.Option(help="Of the mount's errors and of the world.", min=0)] = 1,
) -> None:
    """Let a simulated robot with a badly mounted camera stand and look round, for trying out `mount`."""
    from tulip_sim.camera import CameraParameters, draw_mount
    from tulip_sim.looking_round import DISTANCES, PANS, look_round

    field = load_field()
    if not (abs(x) <= field.carpet_length / 2.0 and abs(y) <= field.carpet_width / 2.0):
        raise BadInputError(f"Place ({x}, {y}) m is not on the carpet; expected one on the field.")
    camera = CameraParameters(mount_angle=math.radians(angle), mount_height=height, mount_seed=seed)
    make_folder(folder)
    place, taken_by, shots = Pose2D(x, y, math.radians(yaw)), head_camera_lens(), []
    console = Console()
    with progress_bar("looking round", len(DISTANCES) * len(PANS), console) as advance:
        for picture, shot in look_round(seed, place, taken_by, camera):
            cv2.imwrite(str(folder / shot.picture), picture)
            shots.append(shot)
            advance()
    write_recording(folder, place, shots)
    write_lens(folder / LENS, taken_by)
    write_mount(folder / "true_mount.yaml", draw_mount(camera), ["What the simulator's camera really had."])
    console.print(f"Wrote {len(shots)} pictures. Next: calibrate.py mount {folder}", soft_wrap=True, highlight=False)


@app.command()
@told
def mount(
    folder: Annotated[Path, typer.Argument(help="Folder with recording.yaml, lens.yaml and the pictures.")],
    lens_file: Annotated[Path | None, typer.Option("--lens", help="Lens file; none: lens.yaml of the folder.")] = None,
    fit: Annotated[str, typer.Option(help=f"Offsets to find, with commas: {', '.join(OFFSETS)}.")] = ",".join(FITTED),
    start: Annotated[Path | None, typer.Option(help="Mount file with what is known; none: no offsets.")] = None,
    output: Annotated[Path, typer.Option(help="Mount file to write.")] = Path("camera_mount.yaml"),
    apply: Annotated[bool, typer.Option("--apply", help="Write the robot's own mount file, too.")] = False,
) -> None:
    """Find how the camera sits on the head, from lines seen by a standing robot that looks round."""
    names = [name.strip() for name in fit.split(",") if name.strip()]
    for name in names:
        if name not in OFFSETS:
            raise unknown("offset", name, OFFSETS)
    if not names:
        raise BadInputError(f"--fit names no offset; expected some of {', '.join(OFFSETS)}.")
    check_writable(output, "--output")
    if apply:
        check_writable(MOUNT_FILE, "--apply")
    place, shots = read_recording(folder)
    known = MountOffsets() if start is None else load_mount(start)
    first = read_picture(folder / shots[0].picture) if shots else None
    size = None if first is None else (first.shape[1], first.shape[0])
    taken_by = read_lens(lens_file or folder / LENS, size)
    calibration = MountCalibration(load_robot(), load_field(), taken_by, place, shots, known, names)
    pictures = list(read_pictures([folder / shot.picture for shot in shots]).values())
    console = Console()
    with progress_bar("finding lines", 2 * len(shots), console) as advance:
        found = calibration.fit(pictures, np.random.default_rng(0), advance)
    report_mount(found, known, console)
    provenance = [
        f"Written by scripts/calibrate.py mount: {found.points} points of lines in {len(found.errors)} pictures",
        f"lie {found.after * 1e3:.2f} mrad beside the lines (RMS); before it was {found.before * 1e3:.2f} mrad.",
        "Standard deviations: "
        + ", ".join(f"{name} {value:.5f}" for name, value in zip(names, found.spread, strict=True)),
    ]
    for path in (output, MOUNT_FILE) if apply else (output,):
        write_mount(path, found.mount, provenance)
    drawing = output.with_suffix(".png")
    best = max(range(len(shots)), key=lambda index: calibration.visible(shots[index], found.mount, found.robot))
    before = calibration.draw(pictures[best], shots[best], known, place)
    after = calibration.draw(pictures[best], shots[best], found.mount, found.robot)
    cv2.imwrite(str(drawing), beside(before, after))
    console.print(f"Wrote {output} and {drawing} (before and after)", soft_wrap=True, highlight=False)


@app.command()
@told
def colours(
    pictures: Annotated[list[Path], typer.Argument(help="Pictures of the field, from one camera in one hall.")],
    label: Annotated[
        list[str] | None,
        typer.Option(help="CLASS:x,y (a click) or CLASS:x,y,w,h [px], CLASS@2 for the second picture; repeatable."),
    ] = None,
    labels_file: Annotated[
        Path | None, typer.Option("--labels", help="YAML: picture: {class: [[x, y, w, h], ...]}.")
    ] = None,
    start: Annotated[Path, typer.Option(help="Colour file to start from.")] = COLOURS_FILE,
    output: Annotated[Path, typer.Option(help="Colour file to write.")] = Path("colours.yaml"),
    apply: Annotated[bool, typer.Option("--apply", help="Write vision's own colour file, too.")] = False,
) -> None:
    """Find the colour classes from labels, or without any from what the present classes find on the carpet."""
    check_writable(output, "--output")
    if apply:
        check_writable(COLOURS_FILE, "--apply")
    known = read_colours(start)
    seen = read_pictures(pictures)
    labels = read_labels(label or [], labels_file, seen)
    check_labels(seen, labels)
    console = Console()
    with progress_bar("fitting colours", 1, console) as advance:
        found = fit_colours(seen, labels, segmentation_parameters(known))
        advance()
    if not found.used:
        raise BadInputError("No class was found on a carpet; label some, as in --label green:x,y,w,h.")
    report_colours(found, known, console)
    how = f"{sum(len(spots) for each in labels.values() for spots in each.values())} labels" if labels else "no labels"
    for path in (output, COLOURS_FILE) if apply else (output,):
        write_colours(path, found.colours, [f"Written by scripts/calibrate.py colours: {len(seen)} pictures, {how}."])
    drawing = output.with_suffix(".png")
    rows = [
        beside(picture, draw_classes(picture, known), draw_classes(picture, found.colours))
        for picture in list(seen.values())[:3]
    ]
    cv2.imwrite(str(drawing), np.concatenate(rows))
    console.print(f"Wrote {output} and {drawing} (picture, before, after)", soft_wrap=True, highlight=False)


def make_board(kind: str, squares: str, square: float) -> Board:
    """Return the board that the options describe."""
    if kind not in (CHESSBOARD, CHARUCO):
        raise unknown("board", kind, (CHESSBOARD, CHARUCO))
    columns, _, rows = squares.lower().partition("x")
    if not (columns.isdecimal() and rows.isdecimal()):
        raise BadInputError(f"--squares is {squares!r}; expected two numbers as in 9x7.")
    return Board(kind, int(columns), int(rows), square)


def find_boards(
    pictures: dict[str, Picture], board: Board, console: Console
) -> tuple[tuple[int, int], dict[str, Corners]]:
    """Return the pictures' size, and the corners in those that show the board."""
    found = {}
    for name in track(list(pictures), "finding boards", console):
        corners = board.find(pictures[name])
        if corners is not None:
            found[name] = corners
    height, width = next(iter(pictures.values())).shape[:2]
    return (width, height), found


def spread_over(corners: Corners, size: tuple[int, int]) -> float:
    """Return how far corners lie from the picture's middle on average [px]: there the lens shows most."""
    return float(np.linalg.norm(corners.pixels - np.array(size) / 2.0, axis=1).mean())


def report_lens(best: LensFit, fits: list[LensFit], missing: dict[str, str], console: Console) -> None:
    """Print what was found, and what was left out."""
    if len(fits) > 1:
        table = Table("model", "pictures", "RMS [px]", "criterion")
        for fit in sorted(fits, key=lambda each: each.criterion):
            chosen = " (chosen)" if fit is best else ""
            table.add_row(f"{fit.model}{chosen}", str(len(fit.errors)), f"{fit.error:.3f}", f"{fit.criterion:.0f}")
        console.print(table)
    table = Table("picture", "RMS [px]", "left out because")
    for name, error in best.errors.items():
        table.add_row(name, f"{error:.2f}", "")
    for name, reason in {**missing, **best.left_out}.items():
        table.add_row(name, "", reason)
    console.print(table)
    fx, fy, cx, cy = best.lens.camera_matrix[[0, 1, 0, 1], [0, 1, 2, 2]].tolist()
    values = zip(("fx", "fy", "cx", "cy"), (fx, fy, cx, cy), best.spread.tolist(), strict=True)
    console.print(
        "  ".join(f"{name} {value:.2f} +- {spread:.2f} px" for name, value, spread in values), highlight=False
    )
    console.print(f"{best.model}: {' '.join(f'{k:.5f}' for k in best.lens.distortion) or 'no coefficients'}")


def report_mount(found: MountFit, known: MountOffsets, console: Console) -> None:
    """Print offsets with their spread, and how well each picture fits."""
    table = Table("picture", "RMS [mrad]")
    for name, error in found.errors.items():
        table.add_row(name, f"{error * 1e3:.2f}")
    console.print(table)
    table = Table("offset", "before", "after", "+-", "unit")
    for name, spread in zip(found.names, found.spread.tolist(), strict=True):
        scale, unit = (1e3, "mm") if name == "height" else (math.degrees(1.0), "deg")
        before, after = getattr(known, name), getattr(found.mount, name)
        table.add_row(name, *(f"{value * scale:.3f}" for value in (before, after, spread)), unit)
    console.print(table)
    roll, pitch = (math.degrees(value) for value in found.lean)
    console.print(
        f"Beside that the trunk rolls {roll:.2f} deg and pitches {pitch:.2f} deg more than measured (bias of the IMU)",
        soft_wrap=True,
        highlight=False,
    )
    console.print(
        f"Points lie {found.after * 1e3:.2f} mrad beside the lines (RMS); before it was {found.before * 1e3:.2f} mrad",
        highlight=False,
    )


def read_labels(
    texts: list[str], file: Path | None, pictures: dict[str, Picture]
) -> dict[str, dict[str, list[Rectangle]]]:
    """Return rectangles by class by picture, from options and from a file."""
    found: dict[str, dict[str, list[Rectangle]]] = {}
    names = list(pictures)
    for text in texts:
        match = re.fullmatch(r"(\w+)(?:@(\d+))?:(\d+),(\d+)(?:,(\d+),(\d+))?", text)
        if match is None:
            raise BadInputError(f"--label is {text!r}; expected as in orange:412,280 or orange@2:400,270,12,12.")
        number = int(match[2] or 1)
        if not 1 <= number <= len(names):
            raise BadInputError(f"--label {text} is of picture {number}; expected 1 to {len(names)}.")
        x, y = int(match[3]), int(match[4])
        spot = (x, y, int(match[5]), int(match[6])) if match[5] else click(x, y, pictures[names[number - 1]])
        found.setdefault(names[number - 1], {}).setdefault(match[1], []).append(spot)
    if file is not None:
        try:
            content = read_yaml(file, ValueError)
            for name, classes in content.items():
                matching = [each for each in names if each == name or Path(each).name == name] or [str(name)]
                for colour, spots in classes.items():
                    into = found.setdefault(matching[0], {}).setdefault(str(colour), [])
                    into += [(int(x), int(y), int(w), int(h)) for x, y, w, h in spots]
        except (AttributeError, TypeError, ValueError, OverflowError) as error:
            raise BadInputError(
                f"--labels {file} is not as expected, picture: {{class: [[x, y, w, h], ...]}}: {error}."
            ) from error
    return found


def click(x: int, y: int, picture: Picture) -> Rectangle:
    """Return the square round a click, cut at the picture's edges; a click outside is left for the check of labels."""
    height, width = picture.shape[:2]
    if not (x < width and y < height):
        return x, y, 1, 1
    half = CLICK // 2
    left, upper = max(x - half, 0), max(y - half, 0)
    return left, upper, min(x + half, width - 1) - left + 1, min(y + half, height - 1) - upper + 1


def report_colours(found: ColourFit, known: ColourFile, console: Console) -> None:
    """Print the boxes before and after, and how many pixels are in them."""
    table = Table("class", "made from [px]", "hue [deg]", "saturation", "value", "pixels before", "after")
    for name, box in found.colours.boxes.items():
        old = known.boxes[name]
        cells = [
            f"{box[side][0]:.3g} to {box[side][1]:.3g}"
            + ("" if box[side] == old[side] else f" (was {old[side][0]:.3g} to {old[side][1]:.3g})")
            for side in box
        ]
        used = str(found.used[name]) if name in found.used else "as it was"
        table.add_row(name, used, *cells, str(found.before[name]), str(found.after[name]))
    console.print(table)


if __name__ == "__main__":
    app()
