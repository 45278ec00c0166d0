"""Writes robot, field and ball into a folder, one folder a format."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import pinocchio as pin

from tulip_description import frames
from tulip_description.export.camera_view import CameraView
from tulip_description.export.mjcf import MjcfWorld, build_mjcf
from tulip_description.export.mjcf_robot import Placement
from tulip_description.export.parts import BALL, FIELD, PARTS, ROBOT, WORLD, ExportError
from tulip_description.export.sdf import build_sdf
from tulip_description.export.urdf_field import build_ball_urdf, build_field_urdf
from tulip_description.field import Field
from tulip_description.materials import Materials
from tulip_description.model import floating_model
from tulip_description.posture import standing_posture
from tulip_description.robot import Robot
from tulip_description.urdf import build_urdf


@dataclass(frozen=True)
class Export:
    """What is written.

    Attributes:
        robot, field, materials: What it is made from.
        camera: What the head camera sees.
        marker: Colour of the team marker, "cyan" or "magenta".
    """

    robot: Robot
    field: Field
    materials: Materials
    camera: CameraView
    marker: str = "cyan"

    @property
    def straight_height(self) -> float:
        """Height of base_link above the ground on straight legs, all joints at zero [m]."""
        model = floating_model(self.robot)
        data = model.createData()
        pin.framesForwardKinematics(model, data, pin.neutral(model))
        return -float(data.oMf[model.getFrameId(frames.LEFT_SOLE)].translation[2])


def _urdf(export: Export) -> dict[str, str]:
    friction = export.materials.joint_friction
    return {
        ROBOT: build_urdf(export.robot, export.marker, joint_friction=friction),
        FIELD: build_field_urdf(export.field),
        BALL: build_ball_urdf(export.field, export.materials),
    }


def _sdf(export: Export) -> dict[str, str]:
    def build(parts: Sequence[str]) -> str:
        e = export
        return build_sdf(e.robot, e.field, e.materials, e.camera, parts, e.straight_height, e.marker)

    return {part: build((part,)) for part in PARTS} | {WORLD: build(PARTS)}


def _mjcf(export: Export) -> dict[str, str]:
    stand = standing_posture(export.robot)
    robot = Placement(export.robot, marker=export.marker, height=export.straight_height, stand=stand)

    def build(parts: Sequence[str]) -> str:
        robots = (robot,) if ROBOT in parts else ()
        return build_mjcf(MjcfWorld(export.field, export.materials, robots, parts, export.camera))

    return {part: build((part,)) for part in PARTS} | {WORLD: build(PARTS)}


FORMATS: dict[str, tuple[str, Callable[[Export], dict[str, str]]]] = {
    "urdf": (".urdf", _urdf),
    "sdf": (".sdf", _sdf),
    "mjcf": (".xml", _mjcf),
}
"""Ending of the files, and what writes them, by format."""


def write(export: Export, folder: Path, formats: Sequence[str]) -> dict[tuple[str, str], Path]:
    """Write FORMAT/PART.ending for each format and part, and for all but URDF a world of all parts.

    Everything is made before anything is written.

    Args:
        export: What to write.
        folder: A new folder, or an empty one.
        formats: Some of `FORMATS`.

    Returns:
        The files by format and part.

    Raises:
        ExportError: if a format is unknown, the folder holds something, it cannot be written, or the robot cannot be
            written in that format.
    """
    unknown = [name for name in formats if name not in FORMATS]
    if unknown or not formats:
        raise ExportError(f"formats are {', '.join(formats) or 'none'}; expected some of {', '.join(FORMATS)}")
    texts = {
        (name, part): (folder / name / f"{part}{FORMATS[name][0]}", text)
        for name in formats
        for part, text in FORMATS[name][1](export).items()
    }
    try:
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise ExportError(f"{folder} exists already and is no empty folder; expected a new one")
        for path, text in texts.values():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ExportError(f"{folder} cannot be written: {error.strerror}") from error
    return {key: path for key, (path, _) in texts.items()}
