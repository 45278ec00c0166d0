"""A folder of pictures with the joint angles and the attitude at which each was taken.

recording.yaml beside the pictures and the lens file lens.yaml:

    robot: {x: 1.0, y: 0.0, yaw: 0.0}             # base_footprint in map, as it was measured or placed
    pictures:
    - picture: look000.png
      pan: 0.1                                    # [rad] measured
      tilt: 0.3
      base_height: 0.93                           # [m] of base_link above the ground
      base_orientation: [0.0, 0.0, 0.0, 1.0]      # x, y, z, w by IMU and legs; yaw as in odom
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import yaml

from tulip_description.planar import Pose2D
from tulip_description.yaml_file import read_yaml

FILE, LENS = "recording.yaml", "lens.yaml"


class RecordingError(ValueError):
    """A recording cannot be used; the message says which and why."""


@dataclass(frozen=True)
class Shot:
    """One picture's file and how the robot held its head.

    Attributes:
        picture: Name of the file in the folder.
        pan, tilt: Measured angles of the head's joints [rad].
        base_height: Of base_link above the ground [m].
        base_orientation: x, y, z, w of base_link in any level frame; its yaw counts from that of the first picture.
    """

    picture: str
    pan: float
    tilt: float
    base_height: float
    base_orientation: tuple[float, float, float, float]

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is missing, not finite, or no unit quaternion.
        """
        numbers = (self.pan, self.tilt, self.base_height, *self.base_orientation)
        if not all(isinstance(value, int | float) and math.isfinite(value) for value in numbers):
            raise ValueError(f"pan, tilt, base_height and base_orientation are {numbers}; expected finite numbers")
        length = sum(value * value for value in self.base_orientation)
        if len(self.base_orientation) != 4 or abs(length - 1.0) > 1e-3 or self.base_height <= 0.0:
            raise ValueError(
                f"base_orientation is {self.base_orientation}, base_height {self.base_height} m;"
                " expected a unit quaternion x, y, z, w and a height > 0"
            )


def write_recording(folder: Path, robot: Pose2D, shots: Sequence[Shot]) -> None:
    """Write recording.yaml.

    Args:
        folder: Where the pictures are.
        robot: Where base_footprint stood in map.
        shots: Of each picture.
    """
    entries = [{**asdict(shot), "base_orientation": list(shot.base_orientation)} for shot in shots]
    content = {"robot": {"x": robot.x, "y": robot.y, "yaw": robot.yaw}, "pictures": entries}
    (folder / FILE).write_text(yaml.safe_dump(content, sort_keys=False, default_flow_style=None))


def read_recording(folder: Path) -> tuple[Pose2D, list[Shot]]:
    """Read recording.yaml of a folder (JSON is YAML, too).

    Raises:
        RecordingError: if it cannot be read or lacks something.
    """
    path = folder / FILE
    content: Any = read_yaml(path, RecordingError)
    try:
        place = Pose2D(*(float(content["robot"][name]) for name in ("x", "y", "yaw")))
        entries = list(content["pictures"])
    except (KeyError, TypeError, ValueError) as error:
        raise RecordingError(f"{path} lacks robot: x, y, yaw or pictures: {error}") from None
    shots = []
    for index, entry in enumerate(entries):
        try:
            shots.append(Shot(**{**entry, "base_orientation": tuple(entry["base_orientation"])}))
        except (KeyError, TypeError, ValueError) as error:
            raise RecordingError(f"{path}: picture {index}: {error}") from None
    return place, shots
