"""Loads exported files and compares them with what they were made from."""

from __future__ import annotations

import importlib.util
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from tulip_description.export.parts import BALL, FIELD, ROBOT, WORLD
from tulip_description.export.write import Export
from tulip_sim.export_check.figures import Difference, Figures, compare
from tulip_sim.export_check.from_sdf import plain_sdf_figures, sdf_figures
from tulip_sim.export_check.from_urdf import urdf_figures
from tulip_sim.export_check.wanted import ball_figures, merged, robot_figures


@dataclass(frozen=True)
class Checked:
    """One file beside what it was made from.

    Attributes:
        name: Format and part, as in "mjcf robot".
        loader: What loaded it.
        differences: Of each kind of number; none of a field, which has no mass; None if nothing could load the file.
    """

    name: str
    loader: str
    differences: tuple[Difference, ...] | None

    @property
    def fits(self) -> bool:
        """Whether nothing differs by more than rounding."""
        return all(difference.fits for difference in self.differences or ())


def check(export: Export, files: Mapping[tuple[str, str], Path]) -> list[Checked]:
    """Load the files and compare them.

    Args:
        export: What the files were made from.
        files: As `tulip_description.export.write.write` returns them.

    Raises:
        ValueError: if a file cannot be loaded or lacks a body or a joint.
    """
    robot, ball = robot_figures(export.robot, export.materials), ball_figures(export.field, export.materials)
    together = Figures({**robot.bodies, **ball.bodies}, robot.joints)
    wanted = {ROBOT: robot, BALL: ball, FIELD: Figures({}, {}), WORLD: together}
    roots = {ROBOT: export.robot.links[0].name, BALL: BALL, FIELD: FIELD}
    rows = []
    for (name, part), path in files.items():
        right = merged(export.robot, wanted[part]) if (name, part) == ("urdf", ROBOT) else wanted[part]
        loader, found = _load(name, path, roots.get(part, ""))
        rows.append(Checked(f"{name} {part}", loader, None if found is None else tuple(compare(found, right))))
    return rows


def _load(name: str, path: Path, root: str) -> tuple[str, Figures | None]:
    """Return what loads a file, and the figures of what moves; None without the library."""
    if name == "urdf":
        return "Pinocchio", urdf_figures(path, root)
    if name == "sdf":
        if importlib.util.find_spec("pydrake") is not None:
            return "libsdformat (Drake)", sdf_figures(path)
        return "own reading, schema not checked: extra sdf is not installed", plain_sdf_figures(path)
    if importlib.util.find_spec("mujoco") is None:
        return "nothing: extra mujoco is not installed", None
    from tulip_sim.export_check.from_mjcf import mjcf_figures

    return "MuJoCo", mjcf_figures(path)
