"""Readers of other people's binary files. They run in a process of their own: see ``table_process``.

A damaged file may crash the libraries that read it, interpreter and all, or make them ask for any amount of
memory.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from daq.importing.array_readers import Columns, add_array, add_vectors, read_hdf5, read_numpy
from daq.importing.bags import BAG_SUFFIXES
from daq.recording.errors import CaptureError
from robots.extras import install_command

# What SciPy raises on a damaged file, besides its own MatReadError.
_MAT_ERRORS = (
    ValueError,
    TypeError,
    LookupError,
    UnboundLocalError,
    OverflowError,
    MemoryError,
    zlib.error,
)


def read_mat(path: Path) -> Columns:
    """Numeric variables of a MATLAB file; those inside structs as ``struct.field``.

    A vector may lie or stand; of a matrix the longer side is time, with columns named name:1, name:2 …

    Raises:
        CaptureError: not a MATLAB file that can be read.
        OSError: it cannot be opened.
    """
    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        content = loadmat(path)
    except NotImplementedError:  # what SciPy says of version 7.3
        return read_hdf5(path, ".")
    except (*_MAT_ERRORS, MatReadError) as error:
        raise CaptureError(f"{path}: is not a MATLAB file") from error
    columns: Columns = {}
    for name, value in content.items():
        _add_variable(columns, name, value)
    return columns


_MOST_PLACES = 64
"""Of a cell that are looked into."""
_DEEPEST = 6
"""Structs within structs that are looked into."""


def _add_variable(columns: Columns, name: str, value: Any, depth: int = 0) -> None:
    """A numeric variable, those of a struct's fields, a vector per place of a cell or an array of structs.

    Objects and texts are left out.
    """
    if not isinstance(value, np.ndarray) or depth > _DEEPEST or name.startswith("__"):
        return
    if value.dtype.names and value.size == 1:
        for field in value.dtype.names:
            _add_variable(columns, f"{name}.{field}", value.ravel()[0][field], depth + 1)
    elif value.dtype.names:
        for field in value.dtype.names:
            add_vectors(columns, f"{name}.{field}", list(value[field].ravel()))
    elif value.dtype.hasobject:
        places = list(value.ravel())[: _MOST_PLACES + 1]
        if not add_vectors(columns, name, places) and len(places) <= _MOST_PLACES:
            for k, place in enumerate(places, start=1):
                _add_variable(columns, f"{name}.{k}", place, depth + 1)
    else:
        add_array(columns, name, value)


def read_parquet(path: Path) -> Columns:
    """Numeric columns of a Parquet file; a list of fixed length has columns name:1, name:2 …

    Raises:
        CaptureError: not a Parquet file, or pyarrow is not installed.
        OSError: it cannot be opened.
    """
    try:
        from pyarrow import ArrowException, types
        from pyarrow.parquet import ParquetFile
    except ImportError:
        command = install_command("parquet")
        raise CaptureError(f"{path}: Parquet needs pyarrow; install it with: {command}") from None
    columns: Columns = {}
    try:
        with ParquetFile(path) as file:
            table: Any = file.read()
            for column, field in zip(table.columns, table.schema, strict=True):
                if types.is_fixed_size_list(field.type):
                    rows = np.asarray(column.combine_chunks().flatten(), dtype=np.float64)
                    add_array(columns, field.name, rows.reshape(-1, field.type.list_size))
                elif types.is_timestamp(field.type):
                    nanoseconds = column.cast("timestamp[ns]").cast("int64")
                    columns[field.name] = np.asarray(nanoseconds, dtype=np.float64)
                elif _is_number(types, field.type):
                    columns[field.name] = np.asarray(column.cast("float64"), dtype=np.float64)
    except (ArrowException, ValueError, TypeError, NotImplementedError, MemoryError) as error:
        reason = " ".join(str(error).split())[:120]
        raise CaptureError(f"{path}: is not a Parquet file that can be read: {reason}") from error
    return columns


def _is_number(types: Any, kind: Any) -> bool:
    tests = (types.is_integer, types.is_floating, types.is_boolean, types.is_decimal)
    return any(test(kind) for test in tests)


def read_bag(path: Path) -> Columns:
    """Columns of a bag's JointState topics; errors as of :func:`daq.importing.joint_states.read_bag`."""
    from daq.importing.joint_states import read_bag as read  # loads libraries that other files do not need

    return read(path)


READERS: dict[str, Callable[[Path], Columns]] = {
    ".mat": read_mat,
    ".parquet": read_parquet,
    ".pq": read_parquet,
    ".npz": read_numpy,
    ".npy": read_numpy,
    **dict.fromkeys((".h5", ".hdf5", ".hdf"), read_hdf5),
    **dict.fromkeys(BAG_SUFFIXES, read_bag),
}
"""By the end of the file's name."""
