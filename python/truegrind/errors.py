"""What truegrind refuses, and where. Every message says where, what was found, what was expected and what to do."""

from __future__ import annotations


class TruegrindError(ValueError):
    """Something was refused. Attributes are ``None`` where they say nothing.

    ``file`` and ``sheet``: where it stands; ``row``: line of the file or row of the sheet, from 1, or the index of an array, from
    0; ``column``: header of the column, or key of a robot file; ``found`` and ``expected``: in words.
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
        # Errors travel between processes: keywords are no arguments of an exception otherwise.
        places = (self.file, self.sheet, self.row, self.column, self.found, self.expected)
        return _again, (type(self), str(self), places)


def _again(kind: type[TruegrindError], message: str, places: tuple) -> TruegrindError:
    names = ("file", "sheet", "row", "column", "found", "expected")
    return kind(message, **dict(zip(names, places)))


class ArgumentError(TruegrindError):
    """An argument that cannot be: a shape, a unit, a word."""


class DatasetError(TruegrindError):
    """Measurements that cannot be read, or are no measurements of this arm."""


class RobotError(TruegrindError):
    """No such robot, or a robot file that cannot be right."""


class ModelError(TruegrindError):
    """A model file that cannot be used, or a model that may not be."""


class FitError(TruegrindError):
    """Rows that carry no fit."""


class ProgramError(TruegrindError):
    """A program that is not corrected."""


class CellError(TruegrindError):
    """A cell file that cannot be used, or contradicts the program."""


class RecipeError(TruegrindError):
    """A recipe of a simulation that cannot be."""


class PlanError(TruegrindError):
    """No poses can be chosen."""


class TrackError(TruegrindError):
    """Measurements that a track cannot take in."""


class InverseError(TruegrindError):
    """A pose that the arm does not reach."""


class Defect(TruegrindError):
    """A defect of truegrind itself. Please report it."""
