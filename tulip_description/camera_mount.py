"""camera_mount.yaml: how the camera really sits on the head, and where the head's joints really are at zero."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from tulip_description.yaml_file import read_yaml, write_lines

MOUNT_FILE = Path(__file__).with_name("camera_mount.yaml")
LARGEST_ANGLE = math.radians(30.0)  # more is no error of mounting but another camera
LARGEST_HEIGHT = 0.2  # [m]


class MountFileError(ValueError):
    """A mount file cannot be used; the message says which and why."""


@dataclass(frozen=True)
class MountOffsets:
    """Offsets between robot.yaml and the real head.

    Attributes:
        roll, pitch, yaw: Turns of camera_link on the head about its axes x (forward), y (left) and z (up): the
            rotation Rz(yaw) Ry(pitch) Rx(roll); a positive pitch looks further down [rad].
        height: Of the camera along the head's z axis [m].
        pan, tilt: What is added to the joints' measured angles [rad]. Tilt does nearly what pitch does: one of the
            two is enough.
    """

    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0
    height: float = 0.0
    pan: float = 0.0
    tilt: float = 0.0

    def __post_init__(self) -> None:
        """Check the values.

        Raises:
            ValueError: if one is not a finite number or too large for an error of mounting.
        """
        for entry in fields(self):
            value = getattr(self, entry.name)
            most, unit = (LARGEST_HEIGHT, "m") if entry.name == "height" else (LARGEST_ANGLE, "rad")
            if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= most:
                raise ValueError(f"{entry.name} is {value!r}; expected a number from {-most:.3g} to {most:.3g} {unit}")

    @property
    def rotation(self) -> NDArray[np.float64]:
        """(3, 3) rotation of the real camera_link in the nominal one."""
        cr, sr, cp, sp = math.cos(self.roll), math.sin(self.roll), math.cos(self.pitch), math.sin(self.pitch)
        cy, sy = math.cos(self.yaw), math.sin(self.yaw)
        return np.array(
            [
                [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr],
                [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr],
                [-sp, cp * sr, cp * cr],
            ]
        )


OFFSETS = tuple(entry.name for entry in fields(MountOffsets))


def load_mount(path: Path = MOUNT_FILE) -> MountOffsets:
    """Read a mount file.

    Raises:
        MountFileError: if it cannot be read or holds anything else than the offsets.
    """
    content = read_yaml(path, MountFileError)
    if not isinstance(content, dict) or not set(content) <= set(OFFSETS):
        raise MountFileError(f"{path} holds {content!r}; expected only {', '.join(OFFSETS)}, each with a number")
    try:
        return MountOffsets(**content)
    except ValueError as error:
        raise MountFileError(f"{path}: {error}") from None


def write_mount(path: Path, mount: MountOffsets, provenance: Sequence[str] = ()) -> None:
    """Write a mount file, all or nothing.

    Args:
        path: The file.
        mount: What to write.
        provenance: Lines that say where the numbers come from.

    Raises:
        OSError: if the file cannot be written.
    """
    lines = [
        "# How the head camera really sits on the head, beside what robot.yaml says; offsets are explained in"
        " camera_mount.py.",
        *(f"# {line}".rstrip() for line in provenance),
        *(f"{name}: {float(getattr(mount, name))!r}" for name in OFFSETS),
    ]
    write_lines(path, lines)
