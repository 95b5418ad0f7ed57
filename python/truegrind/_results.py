"""Arguments as arrays, results as tuples and tables."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


class Poses(NamedTuple):
    """Poses of the flange in the base, one row per row of joint angles; without the first axis for a single one."""

    position_mm: NDArray[np.float64]
    """Origin (mm), shape (N, 3)."""
    rotation: NDArray[np.float64]
    """Rotation matrices, shape (N, 3, 3): columns are the axes of the flange."""

    @property
    def matrix(self) -> NDArray[np.float64]:
        """Homogeneous matrices, translations in mm, shape (N, 4, 4)."""
        out = np.zeros(self.position_mm.shape[:-1] + (4, 4))
        out[..., :3, :3] = self.rotation
        out[..., :3, 3] = self.position_mm
        out[..., 3, 3] = 1.0
        return out


class Solutions(NamedTuple):
    """Joint angles for poses of the flange; without the first axis for a single one."""

    q_deg: NDArray[np.float64]
    """Controller angles (°), shape (N, 6); NaN for poses that were not reached."""
    reached: NDArray[np.bool_]
    """Which poses were reached, shape (N,)."""
    why: list[str | None] | None
    """Reason for each pose that was not reached; ``None`` for the others."""


def doubles(given: Any) -> NDArray[np.float64]:
    """Real numbers as an aligned array of doubles; what a mask hides is NaN."""
    if isinstance(given, np.ma.MaskedArray):
        given = given.astype(np.float64).filled(np.nan)
    array = np.asarray(given)
    if array.dtype.kind not in "biufO":
        raise TypeError(f"values of type {array.dtype}")
    return np.require(array, np.float64, "A")


def table(text: str) -> dict[str, list]:
    """The columns of a CSV text by name: numbers where all cells are numbers, ``None`` for empty cells."""
    header, *rows = csv.reader(io.StringIO(text))
    columns = {name: [row[place] or None for row in rows] for place, name in enumerate(header)}
    return {name: _numbers(cells) for name, cells in columns.items()}


def _numbers(cells: list) -> list:
    try:
        return [None if cell is None else float(cell) for cell in cells]
    except ValueError:
        return cells
