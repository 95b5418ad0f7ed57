"""Exceptions. Messages state where the error is, what was found, what was expected, and the remedy."""

from __future__ import annotations


class TruegrindError(ValueError):
    """Base class of all errors. Attributes are ``None`` if not applicable.

    ``file`` and ``sheet``: location; ``row``: line of the file or row of the sheet, from 1, or index of an array, from 0; ``column``:
    header of the column, key of a file, or name of an argument; ``found`` and ``expected``: values as text.
    """

    def __init__(
        self,
        message: str,
        *,
        file: str | None = None,
        sheet: str | None = None,
        row: int | None = None,
        column: str | None = None,
        found: str | None = None,
        expected: str | None = None,
    ) -> None:
        super().__init__(message)
        self.file = file
        self.sheet = sheet
        self.row = row
        self.column = column
        self.found = found
        self.expected = expected

    def __reduce__(self):
        # Pickling for other processes; by default keyword arguments are lost.
        places = (self.file, self.sheet, self.row, self.column, self.found, self.expected)
        return _again, (type(self), str(self), places)


def _again(kind: type[TruegrindError], message: str, places: tuple) -> TruegrindError:
    names = ("file", "sheet", "row", "column", "found", "expected")
    return kind(message, **dict(zip(names, places)))


class ArgumentError(TruegrindError):
    """Invalid argument: shape, unit or word."""


class DatasetError(TruegrindError):
    """Measurements that cannot be read or do not belong to this robot."""


class RobotError(TruegrindError):
    """Unknown robot or invalid robot file."""


class ModelError(TruegrindError):
    """Invalid model file, or a model that must not be used."""


class FitError(TruegrindError):
    """Measurements that do not suffice for a fit."""


class ProgramError(TruegrindError):
    """A program that cannot be corrected."""


class CellError(TruegrindError):
    """Invalid cell file, or one that contradicts the program."""


class RecipeError(TruegrindError):
    """Invalid recipe of a simulation."""


class PlanError(TruegrindError):
    """No poses can be chosen."""


class TrackError(TruegrindError):
    """Measurements that cannot be used for tracking."""


class InverseError(TruegrindError):
    """A pose out of reach."""


class Defect(TruegrindError):
    """Internal error of truegrind. Please report it."""
