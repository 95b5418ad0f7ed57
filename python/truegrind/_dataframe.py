"""Columns of a data frame by the interchange protocol, without knowing whose it is.

The protocol hands out memory: a pointer, a length, a type and how gaps are marked. Each column is copied out of it once, so that
nothing depends on how long the frame keeps it.
"""

from __future__ import annotations

import ctypes
import warnings
from typing import Any

import numpy as np

from .errors import DatasetError

# Kinds of the protocol, and what marks a gap.
_INT, _UINT, _FLOAT, _BOOL, _STRING, _CATEGORICAL = 0, 1, 2, 20, 21, 23
_NO_GAPS, _NAN, _SENTINEL, _BITS, _BYTES = 0, 1, 2, 3, 4


def columns(frame: Any) -> dict[str, Any]:
    """Each column by name: numbers as an array of doubles with NaN for gaps, text as a list with ``None`` for gaps."""
    try:
        return _columns(frame)
    except DatasetError:
        raise
    except (KeyError, TypeError, ValueError) as error:
        raise DatasetError(
            f"this {type(frame).__name__} cannot be read: {error}; expected a data frame with one plain column for each name",
            found=str(error),
            expected="a data frame with one plain column for each name",
        ) from error


def _columns(frame: Any) -> dict[str, Any]:
    if hasattr(frame, "__dataframe__"):
        with warnings.catch_warnings():
            # pandas means to drop the protocol; what has it not is read by the names of its columns.
            warnings.simplefilter("ignore", DeprecationWarning)
            whole = frame.__dataframe__(allow_copy=True)
        names = [str(name) for name in whole.column_names()]
        parts = list(whole.get_chunks())
        return {name: _joined([_column(part.get_column_by_name(name), name) for part in parts]) for name in names}
    named = getattr(frame, "columns", None)
    if named is None and hasattr(frame, "keys"):
        named = list(frame.keys())
    if named is None:
        raise DatasetError(
            f"found {type(frame).__name__}; expected a data frame: an object with __dataframe__, or columns by name",
            found=type(frame).__name__,
            expected="an object with __dataframe__, or columns by name",
        )
    return {str(name): _plain(frame[name]) for name in named}


def _plain(values: Any) -> Any:
    array = np.asarray(values)
    if array.dtype.kind in "biuf":
        return array.astype(np.float64)
    try:
        return np.array([np.nan if value is None else float(value) for value in array], dtype=np.float64)
    except (TypeError, ValueError):
        return [None if value is None else str(value) for value in array.tolist()]


def _joined(parts: list[Any]) -> Any:
    if len(parts) == 1:
        return parts[0]
    if not parts:
        return np.empty(0)
    if all(isinstance(part, np.ndarray) for part in parts):
        return np.concatenate(parts)
    return [value for part in parts for value in (part.tolist() if isinstance(part, np.ndarray) else part)]


def _column(column: Any, name: str) -> Any:
    kind = column.dtype[0]
    if kind in (_INT, _UINT, _FLOAT, _BOOL):
        return _with_gaps(_values(column, kind), column)
    if kind == _STRING:
        return _texts(column)
    if kind == _CATEGORICAL:
        return _categories(column)
    raise DatasetError(
        f"column {name}: found a kind of values that is neither number nor text ({column.dtype!r}); expected numbers (°, mm, "
        "h, kg) or text; convert the column, or leave it out",
        column=name,
        found=repr(column.dtype),
        expected="numbers or text",
    )


def _memory(buffer: Any, dtype: Any, count: int, offset: int = 0) -> np.ndarray:
    """`count` values from the `offset`th on, copied."""
    dtype = np.dtype(dtype)
    if count == 0:
        return np.empty(0, dtype)
    size = (offset + count) * dtype.itemsize
    if buffer.bufsize < size:
        raise DatasetError(f"the data frame hands out {buffer.bufsize} bytes where {size} are promised")
    raw = (ctypes.c_ubyte * size).from_address(buffer.ptr)
    out = np.frombuffer(raw, dtype=dtype)[offset:]
    # What is copied outlives the frame whatever it does with its memory.
    return out.copy()


def _values(column: Any, kind: int) -> np.ndarray:
    buffer, (kind, bits, form, _) = column.get_buffers()["data"]
    count, offset = column.size(), column.offset
    if kind == _BOOL and bits == 1:
        return _bits(buffer, count, offset).astype(np.float64)
    letter = {_INT: "i", _UINT: "u", _FLOAT: "f", _BOOL: "u"}[kind]
    return _memory(buffer, f"{letter}{bits // 8}", count, offset).astype(np.float64)


def _bits(buffer: Any, count: int, offset: int) -> np.ndarray:
    whole = _memory(buffer, "u1", (offset + count + 7) // 8)
    return np.unpackbits(whole, bitorder="little")[offset : offset + count].astype(bool)


def _gaps(column: Any, values: np.ndarray | None = None) -> np.ndarray | None:
    """Which rows hold nothing; `None` where every row holds something."""
    how, mark = column.describe_null
    if how in (_NO_GAPS, _NAN) or column.null_count == 0:
        return None
    if how == _SENTINEL:
        return None if values is None else values == mark
    validity = column.get_buffers()["validity"]
    if validity is None:
        return None
    buffer, _ = validity
    count, offset = column.size(), column.offset
    marked = _bits(buffer, count, offset) if how == _BITS else _memory(buffer, "u1", count, offset).astype(bool)
    return marked == bool(mark)


def _with_gaps(values: np.ndarray, column: Any) -> np.ndarray:
    gaps = _gaps(column, values)
    if gaps is not None:
        values[gaps] = np.nan
    return values


def _texts(column: Any) -> list[str | None]:
    buffers = column.get_buffers()
    count, offset = column.size(), column.offset
    ends_buffer, (_, bits, _, _) = buffers["offsets"]
    ends = _memory(ends_buffer, f"i{bits // 8}", count + 1, offset)
    letters, _ = buffers["data"]
    whole = _memory(letters, "u1", int(ends[-1]) if count else 0).tobytes()
    gaps = _gaps(column)
    return [
        None if gaps is not None and gaps[row] else whole[ends[row] : ends[row + 1]].decode("utf-8")
        for row in range(count)
    ]


def _categories(column: Any) -> list[str | None]:
    codes = _values(column, _INT)
    gaps = _gaps(column, codes)
    names = _column(column.describe_categorical["categories"], "categories")
    names = names.tolist() if isinstance(names, np.ndarray) else names
    return [
        None if code < 0 or (gaps is not None and gaps[row]) else str(names[int(code)]) for row, code in enumerate(codes)
    ]
