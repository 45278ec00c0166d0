"""Shapes of the 3D scene as plain arrays: many boxes as one mesh, lines as segments."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
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


class Boxes:
    """Boxes fixed to moving frames, drawn as one mesh: a browser without a graphics card draws that fast."""

    def __init__(
        self,
        server: viser.ViserServer,
        name: str,
        boxes: Sequence[tuple[int, Sequence[float], Sequence[float], Colour]],
        opacity: float | None = None,
    ) -> None:
        """Add them; they are hidden until `place`.

        Args:
            server: Of the page.
            name: In the scene, as in /robot.
            boxes: Of each the index of its frame, size [m], centre in the frame [m], and RGB.
            opacity: 0 to 1; None for solid ones.
        """
        self._frames = np.array([frame for frame, *_ in boxes])
        self._centres = np.array([centre for _, _, centre, _ in boxes], dtype=float)
        self._handle = server.scene.add_batched_meshes_simple(
            name,
            CORNERS,
            FACES,
            np.tile((1.0, 0.0, 0.0, 0.0), (len(boxes), 1)),
            np.zeros((len(boxes), 3)),
            batched_scales=np.array([size for _, size, _, _ in boxes], dtype=np.float32),
            batched_colors=np.array([rgb for *_, rgb in boxes], dtype=np.uint8),
            opacity=opacity,
            flat_shading=True,
            lod="off",
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )

    def place(self, frames: NDArray[np.float32] | None) -> None:
        """Put them where their frames are.

        Args:
            frames: (n, 7) position [m] and quaternion x, y, z, w of each frame; None hides the boxes.
        """
        show(self._handle, frames is not None)
        if frames is None:
            return
        rotations = np.array([quaternion_matrix(frame[3:].tolist()) for frame in frames])[self._frames]
        positions = frames[self._frames, :3] + np.einsum("nij,nj->ni", rotations, self._centres)
        self._handle.batched_positions = positions.astype(np.float32)
        self._handle.batched_wxyzs = frames[self._frames][:, [6, 3, 4, 5]].astype(np.float32)
