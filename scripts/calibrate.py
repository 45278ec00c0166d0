"""Calibrate: lens, camera mount and colour classes from pictures."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare()

import functools
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Annotated, ParamSpec, TypeVar

import cv2
import numpy as np
import typer
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from tulip_ros.errors import EXIT_BAD_INPUT, BadInputError, check_writable, unknown
from tulip_vision.calibration.board_pictures import BoardCamera, PictureParameters, spots
from tulip_vision.calibration.boards import CHARUCO, CHESSBOARD, Board, Corners
from tulip_vision.calibration.lens_fit import COEFFICIENTS, FEWEST_PICTURES, LensFit, choose_model, fit_lens
from tulip_vision.calibration.straighten import beside, draw_corners, straighten
from tulip_vision.lens import Lens, head_camera_lens
from tulip_vision.lens_file import read_lens, write_lens

AUTO = "auto"
Picture = NDArray[np.uint8]
P = ParamSpec("P")
Item = TypeVar("Item")

app = typer.Typer(help=__doc__, add_completion=False, no_args_is_help=True)

KIND = Annotated[str, typer.Option("--board", help=f"{CHESSBOARD} or {CHARUCO}.")]
SQUARES = Annotated[str, typer.Option(help="Number of squares, not of corners, as in 9x7.")]
SQUARE = Annotated[float, typer.Option("--square", help="Edge of a square [m].")]


def told(command: Callable[P, None]) -> Callable[P, None]:
    """Tell what cannot be used in one line, with exit code 2."""

    @functools.wraps(command)
    def run(*arguments: P.args, **options: P.kwargs) -> None:
        try:
            command(*arguments, **options)
        except (BadInputError, ValueError) as error:
            print(f"error: {error}", file=sys.stderr)
            raise typer.Exit(EXIT_BAD_INPUT) from None

    return run


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
        raise BadInputError(f"{len(pictures)} pictures are given; expected at least {FEWEST_PICTURES}.")
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


def make_board(kind: str, squares: str, square: float) -> Board:
    """Return the board that the options describe."""
    if kind not in (CHESSBOARD, CHARUCO):
        raise unknown("board", kind, (CHESSBOARD, CHARUCO))
    columns, _, rows = squares.lower().partition("x")
    if not (columns.isdecimal() and rows.isdecimal()):
        raise BadInputError(f"--squares is {squares!r}; expected two numbers as in 9x7.")
    return Board(kind, int(columns), int(rows), square)


def make_folder(folder: Path) -> None:
    """Make a folder, or take an empty one."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if any(folder.iterdir()):
            raise BadInputError(f"Folder {folder} is not empty; name a new one.")
    except OSError as error:
        raise BadInputError(f"Folder {folder} cannot be made: {error.strerror}.") from error


def read_picture(path: Path) -> Picture:
    """Return a picture, (height, width, 3) BGR."""
    try:
        content = np.frombuffer(path.read_bytes(), np.uint8)
    except OSError as error:
        raise BadInputError(f"Picture {path} cannot be read: {error.strerror}.") from error
    picture = cv2.imdecode(content, cv2.IMREAD_COLOR) if content.size else None
    if picture is None:
        raise BadInputError(f"Picture {path} is none that can be read; expected PNG, JPEG or the like.")
    return np.asarray(picture, np.uint8)


def read_pictures(paths: list[Path]) -> dict[str, Picture]:
    """Return pictures by the names that were given; all of one size."""
    found: dict[str, Picture] = {}
    for path in paths:
        picture = read_picture(path)
        first = next(iter(found.values()), picture)
        if picture.shape != first.shape:
            raise BadInputError(
                f"Picture {path} has {picture.shape[1]} x {picture.shape[0]} px, {next(iter(found))} has"
                f" {first.shape[1]} x {first.shape[0]} px; expected all of one size, from one camera."
            )
        found[str(path)] = picture
    return found


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


def track(items: Sequence[Item], text: str, console: Console) -> Iterator[Item]:
    """Go through a list with a progress bar."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=console) as bar:
        yield from bar.track(items, description=text)


if __name__ == "__main__":
    app()
