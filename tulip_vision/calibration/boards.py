"""Chessboards and ChArUco boards: what they look like, and where their corners are in a picture."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

CHESSBOARD, CHARUCO = "chessboard", "charuco"
DICTIONARY = cv2.aruco.DICT_4X4_250
MARKER_SHARE = 0.75  # of a square: wide enough a rim for the corner, large enough bits for the marker
FEWEST_CORNERS = 8  # a pose has 6 unknowns; with 16 numbers the corners also check each other
MARGIN = 1.0  # [squares] white paper round the board, which the detectors need


@dataclass(frozen=True)
class Board:
    """A flat board of squares.

    Attributes:
        kind: "chessboard" or "charuco" (markers of the dictionary 4X4_250 in the white squares).
        columns, rows: Number of squares; corners lie between them.
        square: Edge of one [m].
    """

    kind: str = CHESSBOARD
    columns: int = 9
    rows: int = 7
    square: float = 0.03

    def __post_init__(self) -> None:
        """Check the numbers.

        Raises:
            ValueError: if one is out of range.
        """
        if self.kind not in (CHESSBOARD, CHARUCO):
            raise ValueError(f"board is {self.kind!r}; expected {CHESSBOARD} or {CHARUCO}")
        if not (4 <= self.columns <= 20 and 4 <= self.rows <= 20):
            raise ValueError(f"board has {self.columns} x {self.rows} squares; expected 4 to 20 each way")
        if not 0.001 <= self.square <= 1.0:
            raise ValueError(f"squares are {self.square} m; expected 0.001 to 1 m")

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of all squares together [m]."""
        return self.columns * self.square, self.rows * self.square

    def image(self, pixels_per_square: int) -> Picture:
        """Return the board as it is printed, grey, with white paper all round it."""
        size = (self.columns * pixels_per_square, self.rows * pixels_per_square)
        if self.kind == CHARUCO:
            squares: Picture = np.asarray(self._charuco.generateImage(size), np.uint8)
        else:
            row, column = np.mgrid[0 : size[1], 0 : size[0]] // pixels_per_square
            squares = np.where((row + column) % 2 == 0, np.uint8(0), np.uint8(255))
        margin = round(MARGIN * pixels_per_square)
        return np.pad(squares, margin, constant_values=255)

    def find(self, picture: Picture) -> Corners | None:
        """Return the corners that a picture, (h, w) grey or (h, w, 3) BGR, shows; None if there are too few."""
        grey = cv2.cvtColor(picture, cv2.COLOR_BGR2GRAY) if picture.ndim == 3 else picture
        return self._find_charuco(grey) if self.kind == CHARUCO else self._find_chessboard(grey)

    @cached_property
    def _charuco(self) -> Any:
        dictionary = cv2.aruco.getPredefinedDictionary(DICTIONARY)
        marker = MARKER_SHARE * self.square
        return cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, marker, dictionary)

    @cached_property
    def _detector(self) -> Any:
        return cv2.aruco.CharucoDetector(self._charuco)

    def _find_charuco(self, grey: Picture) -> Corners | None:
        pixels, numbers, _, _ = self._detector.detectBoard(grey)
        if numbers is None or len(numbers) < FEWEST_CORNERS:
            return None
        numbers = np.asarray(numbers, np.int32).reshape(-1)
        # Corners of one row or column only do not tell how the board is turned.
        rows, columns = np.divmod(numbers, self.columns - 1)
        if len(set(rows.tolist())) < 2 or len(set(columns.tolist())) < 2:
            return None
        points = np.asarray(self._charuco.getChessboardCorners(), np.float64).reshape(-1, 3)[numbers]
        return Corners(points, np.asarray(pixels, np.float64).reshape(-1, 2))

    def _find_chessboard(self, grey: Picture) -> Corners | None:
        flags = cv2.CALIB_CB_NORMALIZE_IMAGE | cv2.CALIB_CB_EXHAUSTIVE | cv2.CALIB_CB_ACCURACY
        found, pixels = cv2.findChessboardCornersSB(grey, (self.columns - 1, self.rows - 1), flags=flags)
        if not found:
            return None
        row, column = np.mgrid[1 : self.rows, 1 : self.columns]
        points = np.stack([column.ravel(), row.ravel(), np.zeros(row.size)], axis=1) * self.square
        return Corners(points, np.asarray(pixels, np.float64).reshape(-1, 2))


@dataclass(frozen=True)
class Corners:
    """Corners of a board in one picture.

    Attributes:
        points: (n, 3) on the board, z = 0, from the corner of its first square [m].
        pixels: (n, 2) in the picture [px].
    """

    points: Array
    pixels: Array
