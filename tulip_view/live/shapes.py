"""Shapes of the 3D scene as plain arrays: many boxes as one mesh, lines as segments."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray

from tulip_description.quaternion import quaternion_matrix

Array = NDArray[np.float64]
Colour = tuple[int, int, int]

CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)], dtype=np.float32)
FACES = np.array(
    [(0, 1, 3), (0, 3, 2), (4, 6, 7), (4, 7, 5), (0, 4, 5), (0, 5, 1), (2, 3, 7), (2, 7, 6), (0, 2, 6), (0, 6, 4),
     (1, 5, 7), (1, 7, 3)], dtype=np.uint32,
)  # fmt: skip
"""Of a cube, seen from outside."""
AWAY = (0.0, 0.0, -50.0)
"""[m] Where those of a batch wait that are not there."""
UNTURNED = (1.0, 0.0, 0.0, 0.0)


def colour(words: str) -> Colour:
    """Return RGB of a colour as in #0072b2."""
    red, green, blue = (int(words[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue


def segments(lines: Sequence[Array], closed: bool = True) -> NDArray[np.float32]:
    """Return (n, 2, 3) pieces of lines, each (m, 2) or (m, 3); NaN leaves a gap.

    Args:
        lines: The lines [m].
        closed: Whether a line ends where it began without saying so.
    """
    pieces = [np.zeros((0, 2, 3))]
    for line in lines:
        points = np.column_stack([line, np.zeros((len(line), 3 - line.shape[1]))])
        points = np.vstack([points, points[:1]]) if closed else points
        pairs = np.stack([points[:-1], points[1:]], axis=1)
        pieces.append(pairs[np.isfinite(pairs).all(axis=(1, 2))])
    return np.concatenate(pieces).astype(np.float32)


def show(handle: viser.SceneNodeHandle | viser.GuiImageHandle, shown: bool) -> None:
    """Show or hide something, and send that to the browser only where it changes."""
    if handle.visible != shown:
        handle.visible = shown


class Solid(NamedTuple):
    """One solid of a batch.

    Attributes:
        frame: Index of the frame that it is fixed to.
        size: Edges or diameters [m].
        centre: In the frame [m].
        rgb: Its colour.
    """

    frame: int
    size: Sequence[float]
    centre: Sequence[float]
    rgb: Colour


class Batch:
    """Boxes or balls fixed to moving frames, drawn as one mesh: a browser without a graphics card draws that fast.

    What moves together must not be of different kinds for the browser: it would move one kind a picture later.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        solids: Sequence[Solid],
        opacity: float | None = None,
        round_: bool = False,
    ) -> None:
        """Add them; they are hidden until `place`.

        Args:
            server: Of the page.
            name: In the scene, as in /robot.
            solids: What there is.
            opacity: 0 to 1; None for solid ones.
            round_: Balls instead of boxes.
        """
        self._frames = np.array([solid.frame for solid in solids])
        self._centres = np.array([solid.centre for solid in solids], dtype=float)
        vertices, faces = _ball() if round_ else (CORNERS, FACES)
        self._handle = server.scene.add_batched_meshes_simple(
            name,
            vertices,
            faces,
            np.tile((1.0, 0.0, 0.0, 0.0), (len(solids), 1)),
            np.zeros((len(solids), 3)),
            batched_scales=np.array([solid.size for solid in solids], dtype=np.float32),
            batched_colors=np.array([solid.rgb for solid in solids], dtype=np.uint8),
            opacity=opacity,
            flat_shading=not round_,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )

    def place(self, frames: NDArray[np.float32] | None) -> None:
        """Put them where their frames are.

        Args:
            frames: (n, 7) position [m] and quaternion x, y, z, w of each frame, NaN for one that is not there; None
                hides them all.
        """
        known = frames is not None and bool(np.isfinite(frames).all(axis=1).any())
        show(self._handle, known)
        if frames is None or not known:
            return
        rotations = np.array([quaternion_matrix(frame[3:].tolist()) for frame in frames])[self._frames]
        positions = frames[self._frames, :3] + np.einsum("nij,nj->ni", rotations, self._centres)
        there = np.isfinite(positions).all(axis=1, keepdims=True)
        self._handle.batched_positions = np.where(there, positions, AWAY).astype(np.float32)
        self._handle.batched_wxyzs = np.where(there, frames[self._frames][:, [6, 3, 4, 5]], UNTURNED).astype(np.float32)


def at(*points: Array) -> NDArray[np.float32]:
    """Return (n, 7) frames at points (3,), parallel to the map's."""
    return np.array([(*point, 0.0, 0.0, 0.0, 1.0) for point in points], dtype=np.float32)


def _ball() -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    """Return vertices and faces of a ball of diameter one."""
    mesh = trimesh.creation.icosphere(subdivisions=2, radius=0.5)
    return mesh.vertices.astype(np.float32), mesh.faces.astype(np.uint32)
