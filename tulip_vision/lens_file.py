"""Lens files: YAML that says how a camera's lens bends light.

Written, and read first of all, in the form that ROS's camera_calibration and camera_info_manager use:

    image_width: 640
    image_height: 480
    camera_matrix: {rows: 3, cols: 3, data: [fx, 0, cx, 0, fy, cy, 0, 0, 1]}
    distortion_model: plumb_bob
    distortion_coefficients: {rows: 1, cols: 5, data: [k1, k2, p1, p2, k3]}

Two others are read as well: the entries of a CameraInfo message (width, height, distortion_model, d, k), and the lens
files of the pictures of the Visual Mesh data sets (projection, focal_length, centre, k, fov), which do not say how
large their picture is.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from tulip_description.yaml_file import read_yaml, write_lines
from tulip_vision.lens import Lens
from tulip_vision.lens_models import EQUIDISTANT, EQUISOLID, RECTILINEAR

PROJECTIONS = {"RECTILINEAR": RECTILINEAR, "EQUIDISTANT": EQUIDISTANT, "EQUISOLID": EQUISOLID}
"""Names of the Visual Mesh's projections."""
KEYS = ("image_width", "image_height", "camera_matrix", "distortion_model", "distortion_coefficients")


class LensFileError(ValueError):
    """A lens file cannot be used; the message says which and why."""


def read_lens(path: Path, size: tuple[int, int] | None = None) -> Lens:
    """Read a lens file in any of the three forms.

    Args:
        path: The file.
        size: Width and height of the picture [px], for files that do not say it; with others it must agree.

    Raises:
        LensFileError: if the file cannot be read, is of another form, or describes no lens.
    """
    content = read_yaml(path, LensFileError)
    try:
        lens = lens_of(content, size)
    except (TypeError, ValueError, OverflowError) as error:
        raise LensFileError(f"{path}: {error}") from None
    if size is not None and (lens.width, lens.height) != size:
        raise LensFileError(
            f"{path} is for pictures of {lens.width} x {lens.height} px; expected {size[0]} x {size[1]} px"
        )
    return lens


def lens_of(content: Any, size: tuple[int, int] | None = None) -> Lens:
    """Return the lens that the content of a lens file describes.

    Raises:
        ValueError: if it describes none.
        TypeError: if an entry is of another kind than expected.
        OverflowError: if the picture's size is infinite.
    """
    if not isinstance(content, Mapping):
        raise ValueError(f"content is {type(content).__name__}; expected a mapping with {', '.join(KEYS)}")
    if "projection" in content:
        return _of_visual_mesh(content, size)
    if "k" in content:
        return Lens.from_camera_info(content)
    missing = [key for key in KEYS if key not in content]
    if missing:
        raise ValueError(f"lacks {', '.join(missing)}; expected {', '.join(KEYS)}")
    matrix = _numbers(content, "camera_matrix")
    if len(matrix) != 9:
        raise ValueError(f"camera_matrix has {len(matrix)} numbers; expected 9")
    return Lens(
        int(content["image_width"]),
        int(content["image_height"]),
        np.reshape(matrix, (3, 3)),
        _numbers(content, "distortion_coefficients"),
        str(content["distortion_model"]),
    )


def write_lens(path: Path, lens: Lens, name: str = "head_camera", provenance: Sequence[str] = ()) -> None:
    """Write a lens file in ROS's form, all or nothing.

    Args:
        path: The file.
        lens: What to write.
        name: Of the camera.
        provenance: Lines that say where the numbers come from.

    Raises:
        OSError: if the file cannot be written.
    """
    info = lens.to_camera_info()
    projection = np.hstack([lens.camera_matrix, np.zeros((3, 1))])

    def matrix(values: Any, columns: int) -> str:
        data = [float(value) for value in np.ravel(values)]
        return f"{{rows: {len(data) // columns if columns else 0}, cols: {columns}, data: {data!r}}}"

    lines = [
        *(f"# {line}".rstrip() for line in provenance),
        f"image_width: {lens.width}",
        f"image_height: {lens.height}",
        f"camera_name: {name}",
        f"camera_matrix: {matrix(info['k'], 3)}",
        f"distortion_model: {info['distortion_model']}",
        f"distortion_coefficients: {matrix(info['d'], len(info['d']))}",
        f"rectification_matrix: {matrix(np.eye(3), 3)}",
        f"projection_matrix: {matrix(projection, 4)}",
    ]
    write_lines(path, lines)


def _numbers(content: Mapping[str, Any], key: str) -> list[float]:
    """Return the numbers of a matrix, which ROS writes as rows, cols and data."""
    value = content[key]
    data = value.get("data") if isinstance(value, Mapping) else value
    if not isinstance(data, Sequence) or isinstance(data, str):
        raise ValueError(f"{key} is {value!r}; expected rows, cols and data with numbers")
    return [float(number) for number in data]


def _of_visual_mesh(content: Mapping[str, Any], size: tuple[int, int] | None) -> Lens:
    """Return the lens of a file of the Visual Mesh, whose centre is counted left and up from the picture's middle."""
    if content["projection"] not in PROJECTIONS:
        raise ValueError(f"projection is {content['projection']!r}; expected one of {', '.join(PROJECTIONS)}")
    if size is None:
        raise ValueError("does not say how large the picture is; expected its size to be given")
    if "focal_length" not in content:
        raise ValueError("lacks focal_length")
    if any(float(number) != 0.0 for number in content.get("k", ())):
        raise ValueError(f"k is {content['k']}; expected zeros: its polynomial in the radius is none of our models")
    left, up = (float(number) for number in content.get("centre", (0.0, 0.0)))
    focal = float(content["focal_length"])
    middle = ((size[0] - 1) / 2.0 - left, (size[1] - 1) / 2.0 - up)
    matrix = [[focal, 0.0, middle[0]], [0.0, focal, middle[1]], [0.0, 0.0, 1.0]]
    return Lens(size[0], size[1], matrix, np.zeros(4), PROJECTIONS[content["projection"]])
