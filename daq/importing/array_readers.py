"""NumPy archives, HDF5, and MATLAB's files of version 7.3, which are HDF5."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from daq.recording.errors import CaptureError
from robots.extras import install_command

Columns = dict[str, NDArray[np.float64]]

_NUMPY_ERRORS = (
    ValueError,
    KeyError,
    EOFError,
    zipfile.BadZipFile,
    zlib.error,
    MemoryError,
    NotImplementedError,
)
_HDF5_ERRORS = (OSError, ValueError, KeyError, RuntimeError, TypeError, MemoryError)
_MOST_SIDES = 2
"""Of an array that may hold channels; what has more, such as pictures, is not even read."""
_MOST_PLACES = 64
"""Of a cell or an array of structs that is looked into."""
_HIDDEN = "#"
"""MATLAB keeps what its cells and objects refer to in groups whose names begin so."""


def add_array(columns: Columns, name: str, value: NDArray[Any]) -> None:
    """A vector, a matrix (its longer side is time) or a table with named fields; others are left out."""
    if value.dtype.names:
        for field in value.dtype.names:
            add_array(columns, f"{name}.{field}" if name else field, value[field])
    elif value.dtype.kind in "iufb" and value.ndim <= 2 and value.size:
        table = np.asarray(value, dtype=np.float64)
        if table.ndim == 2 and min(table.shape) > 1:
            table = table.T if table.shape[0] < table.shape[1] else table
            columns |= {f"{name}:{k + 1}": table[:, k].copy() for k in range(table.shape[1])}
        else:
            columns[name] = table.ravel()


def add_vectors(columns: Columns, name: str, values: Sequence[Any]) -> bool:
    """One column ``name:1``, ``name:2`` … of each of some vectors of one length; False where they are none.

    MATLAB users keep a vector per joint in the places of a cell, or in a field of an array of structs.
    """
    vectors = [np.asarray(value) for value in values]
    lengths = {vector.size for vector in vectors if vector.size == max(vector.shape, default=0)}
    numbers = all(vector.dtype.kind in "iufb" and vector.size > 1 for vector in vectors)
    if not 1 <= len(vectors) <= _MOST_PLACES or not numbers or len(lengths) != 1:
        return False
    if any(vector.size not in lengths for vector in vectors):
        return False
    for k, vector in enumerate(vectors, start=1):
        columns[f"{name}:{k}"] = vector.ravel().astype(np.float64)
    return True


def read_numpy(path: Path) -> Columns:
    """The arrays of a .npz archive by name, or that of a .npy file, whose columns are ``data:1`` …

    Raises:
        CaptureError: not such a file; pickled objects are never loaded.
        OSError: it cannot be opened.
    """
    columns: Columns = {}
    try:
        loaded = np.load(path, allow_pickle=False)
        if isinstance(loaded, np.ndarray):
            add_array(columns, "" if loaded.dtype.names else "data", loaded)
            return columns
        with loaded as archive:
            for name in archive.files:
                add_array(columns, name, archive[name])
    except _NUMPY_ERRORS as error:
        reason = " ".join(str(error).split())[:120]
        raise CaptureError(f"{path}: is not a NumPy file of numbers: {reason}") from error
    return columns


def read_hdf5(path: Path, separator: str = "/") -> Columns:
    """The numeric data sets of an HDF5 file, by their path without the first slash.

    Args:
        path: the file.
        separator: between the names of groups.

    Raises:
        CaptureError: not such a file, or h5py is not installed.
        OSError: it cannot be opened.
    """
    try:
        import h5py
    except ImportError:
        raise CaptureError(f"{path}: HDF5 needs h5py; install it with: {install_command('hdf5')}") from None
    with path.open("rb"):
        pass  # what the system says of a file that is not there is clearer
    columns: Columns = {}

    def visit(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset) and h5py.check_ref_dtype(item.dtype) and item.size <= _MOST_PLACES:
            places = [item.file[place] for place in item[()].ravel() if place]
            if not name.startswith(_HIDDEN) and all(isinstance(place, h5py.Dataset) for place in places):
                add_vectors(columns, name.replace("/", separator), [place[()] for place in places])
            return
        text = item.attrs.get("MATLAB_class") in (b"char", b"cell", b"function_handle")
        if text or not isinstance(item, h5py.Dataset) or name.startswith(_HIDDEN) or item.ndim > _MOST_SIDES:
            return
        if item.dtype.names or item.dtype.kind in "iufb":
            add_array(columns, name.replace("/", separator), item[()])

    try:
        with h5py.File(path, "r") as file:
            file.visititems(visit)
    except _HDF5_ERRORS as error:
        reason = " ".join(str(error).split())[:120]
        raise CaptureError(f"{path}: is not an HDF5 file that can be read: {reason}") from error
    return columns
