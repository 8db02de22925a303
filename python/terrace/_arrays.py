# SPDX-License-Identifier: Apache-2.0
"""Converts the arrays that users pass in to numpy arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ._types import AnyArray, Float64Array, UInt32Array


def filled(array: Any) -> Any:
    """Returns a masked array of numbers with NaN where it is masked; returns other arrays unchanged."""
    if not isinstance(array, np.ma.MaskedArray) or array.dtype.kind not in 'iuf':
        return array
    floats: Any = array if array.dtype.kind == 'f' else array.astype(np.float64)
    return floats.filled(np.nan)


def as_array(value: Any, what: str) -> AnyArray:
    """Returns an array of any object with numpy's array interface, the buffer protocol or DLPack.

    Masked floats become NaN.

    Raises: TypeError for objects that are not numbers; ValueError for masked values of a type without NaN.
    """
    if isinstance(value, np.ma.MaskedArray):
        if value.dtype.kind == 'f':
            return filled(value)
        if np.ma.is_masked(value):
            raise ValueError(f'{what} has masked values, which {value.dtype} cannot represent; remove or fill them')
        return value.data
    if isinstance(value, np.ndarray):
        return value
    if hasattr(value, '__dlpack__') and not hasattr(value, '__array__') and not hasattr(value, '__array_interface__'):
        return np.from_dlpack(value)
    array = np.asarray(value)
    if array.dtype.kind == 'O':
        raise TypeError(f'{what} is not an array of numbers')
    return array


def as_numbers(value: Any, what: str) -> Float64Array:
    """Returns as_array() as contiguous float64. Raises: TypeError unless it holds real numbers."""
    array = as_array(filled(value), what)
    if array.dtype.kind not in 'iufb':
        raise TypeError(f'{what} has the type {array.dtype}; real numbers are needed')
    return np.ascontiguousarray(array, dtype=np.float64)


def as_rows(value: Any, what: str, widths: Sequence[int] = (2, 3)) -> Float64Array:
    """Returns points as float64 rows, shape (n, w) with w in ``widths``. An empty list gives zero points."""
    array = as_numbers(value, what)
    if array.size == 0 and array.ndim == 1:
        array = array.reshape(0, widths[0])
    if array.ndim != 2 or array.shape[1] not in widths:
        shapes = ' or '.join(f'(n, {width})' for width in widths)
        raise ValueError(f'{what} must have the shape {shapes}, not {array.shape}')
    return array


def as_native(array: AnyArray, what: str) -> AnyArray:
    """Returns an array of a type that the library supports, without a copy where possible."""
    if array.dtype.kind == 'b':
        return array.view(np.uint8)
    if array.dtype == np.float16:
        return array.astype(np.float32)
    if array.dtype.kind not in 'iuf' or array.dtype.itemsize > 8:
        raise TypeError(f'{what} has the type {array.dtype}; integers and floats of up to 64 bits are needed')
    return array if array.dtype.isnative else array.astype(array.dtype.newbyteorder('='))


def as_numbered(value: Any, what: str, width: int | None = None, least: int = 0, most: int = 2 ** 32 - 2) -> AnyArray:
    """Returns integers from ``least`` to ``most``, in one dimension or in rows of ``width``, in the given type.

    Raises: TypeError, ValueError.
    """
    array = as_array(value, what)
    if array.size == 0:
        array = np.empty((0,) if width is None else (0, width), np.uint32)
    if array.dtype.kind not in 'iu':
        raise TypeError(f'{what} must be whole numbers, not {array.dtype}')
    if array.ndim != (1 if width is None else 2) or width not in (None, array.shape[-1]):
        raise ValueError(f'{what} must have the shape {"(n,)" if width is None else f"(n, {width})"}, not {array.shape}')
    if array.size and (array.min() < least or array.max() > most):
        raise ValueError(f'{what} must be between {least} and {most}')
    return array


def as_labels(labels: Any) -> UInt32Array:
    """Renumbers integer labels of any size as 0, 1, ...; None gives an empty array. Raises: TypeError."""
    if labels is None:
        return np.empty(0, np.uint32)
    labels = as_array(labels, 'labels')
    if labels.dtype.kind not in 'iu':
        raise TypeError(f'labels must be whole numbers, not {labels.dtype}')
    return np.unique(labels, return_inverse=True)[1].reshape(labels.shape).astype(np.uint32)


def as_integer(value: Any, what: str, least: int = 0, bits: int = 64) -> int:
    """Returns an integer of at least ``least`` that fits into an unsigned integer of ``bits`` bits.

    Raises: TypeError, ValueError.
    """
    try:
        number = value.__index__()
    except AttributeError:
        raise TypeError(f'`{what}` must be a whole number, not {value!r}') from None
    if number < least:
        raise ValueError(f'`{what}` must be at least {least}, not {number}')
    if number >= 2 ** bits:
        raise ValueError(f'`{what}` must be below 2^{bits}, not {number}')
    return number
