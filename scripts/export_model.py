"""Write robot, field and ball as URDF, SDF (Gazebo) and MJCF (MuJoCo), load them again and compare."""

from __future__ import annotations

import _environment

if __name__ == "__main__":
    _environment.prepare(("mujoco",))

import math
import sys
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from tulip_description.export.camera_view import CameraView
from tulip_description.export.write import FORMATS, Export, write
from tulip_description.field import load_field
from tulip_description.robot import VARIANTS, load_robot
from tulip_ros.errors import EXIT_BAD_INPUT
from tulip_sim.export_check.check import Checked, check
from tulip_sim.parameters import WorldParameters, materials_of
from tulip_sim.timing import CAMERA_TICKS, TICK
from tulip_vision.lens import head_camera_lens

DIFFERENT = 1
"""Exit code if a file is not what it was made from."""


def head_camera() -> CameraView:
    """Return what the head camera sees, without its distortion."""
    lens = head_camera_lens()
    return CameraView(lens.width, lens.height, float(lens.camera_matrix[0, 0]), 1000.0 / (CAMERA_TICKS * TICK))


def table_of(rows: list[Checked]) -> Table:
    """Return the greatest differences, a line a quantity."""
    table = Table("file", "quantity", "compared", "greatest difference", "at")
    for row in rows:
        table.add_row(f"{row.name}: {row.loader}", "not loaded" if row.differences is None else "loaded")
        for difference in row.differences or ():
            there = not math.isnan(difference.greatest)
            size = f"{difference.greatest:.1e}" if there else "not told"
            where = difference.where if difference.greatest > 0.0 else ""
            style = None if difference.fits else "red"
            table.add_row("", escape(difference.quantity), str(difference.count), size, where, style=style)
        table.add_section()
    return table


def main(
    to: Annotated[Path, typer.Argument(help="New folder for the files.")],
    formats: Annotated[str, typer.Option(help=f"Some of {', '.join(FORMATS)}.")] = ",".join(FORMATS),
    variant: Annotated[str, typer.Option(help=f"{' or '.join(VARIANTS)}.")] = "playing",
    body: Annotated[Path | None, typer.Option(help="Body file of an identification.")] = None,
    marker: Annotated[str, typer.Option(help="Team marker: cyan or magenta.")] = "cyan",
) -> None:
    """Export; masses, CoMs, inertias and joints are compared after loading. Exit code 1 if they differ."""
    try:
        robot = load_robot(variant, body=body)
        export = Export(robot, load_field(), materials_of(WorldParameters()), head_camera(), marker)
        names = [name.strip() for name in formats.split(",") if name.strip()]
        files = write(export, to, names)
    except ValueError as error:
        print(f"error: {error}", file=sys.stderr)
        raise typer.Exit(EXIT_BAD_INPUT) from None
    for path in files.values():
        print(f"wrote {path}")
    try:
        rows = check(export, files)
    except ValueError as error:
        print(f"error: a file that was written is not right: {error}", file=sys.stderr)
        raise typer.Exit(DIFFERENT) from None
    Console(width=None if sys.stdout.isatty() else 110).print(table_of(rows))
    if not all(row.fits for row in rows):
        print("error: a file differs from what it was made from", file=sys.stderr)
        raise typer.Exit(DIFFERENT)


if __name__ == "__main__":
    typer.run(main)
