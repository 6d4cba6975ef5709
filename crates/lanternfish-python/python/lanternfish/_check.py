"""Checks of what callers pass: shapes, types, and numbers that are none."""

from __future__ import annotations

from typing import Any, Sequence

import numpy as np


def array(value: Any, shape: Sequence[int | None], what: str, dtype: Any = np.float32) -> np.ndarray:
    """`value` as an array of this shape (None: any number), contiguous, of finite numbers that `dtype` can hold."""
    given = np.asarray(value)
    if given.dtype.kind not in "biuf":
        raise ValueError(f"{what}: numbers are meant, not {given.dtype}")
    if given.ndim != len(shape) or any(want is not None and have != want for have, want in zip(given.shape, shape)):
        meant = " x ".join("any" if want is None else str(want) for want in shape)
        shown = " x ".join(map(str, given.shape)) or "one number"
        raise ValueError(f"{what}: an array of {meant} numbers is meant, not {shown}")
    if np.dtype(dtype).kind in "iu":
        if given.dtype.kind == "f" and not (given == np.floor(given)).all():
            raise ValueError(f"{what}: whole numbers are meant, not {given.dtype}")
        bounds = np.iinfo(dtype)
        if given.size and not (given.min() >= bounds.min and given.max() <= bounds.max):
            raise ValueError(f"{what}: numbers from {bounds.min} to {bounds.max} are meant")
    with np.errstate(over="ignore"):
        result = np.array(given, dtype=dtype, order="C")
    if result.dtype.kind == "f" and not np.isfinite(result).all():
        raise ValueError(f"{what}: a number is not finite (NaN, infinite, or beyond 32 bits)")
    return result


def number(value: Any, what: str) -> float:
    return float(array(value, (), what))


def vector(value: Any, what: str, count: int = 3) -> list[float]:
    return array(value, (count,), what).tolist()


def color(value: Any, what: str, count: int = 3) -> list[float]:
    """One number for grey, or red, green, blue (and alpha, 1 where it is left out)."""
    given = np.asarray(value)
    if given.ndim == 0:
        given = np.repeat(given, 3)
    if count == 4 and given.shape == (3,):
        given = np.append(given, 1.0)
    return vector(given, what, count)


def pose(value: Any, what: str = "pose") -> np.ndarray:
    """A 4 x 4 matrix that maps to the world, row by row; None: the identity."""
    matrix = np.eye(4, dtype=np.float32) if value is None else array(value, (4, 4), what)
    if not np.allclose(matrix[3], (0, 0, 0, 1), atol=1e-6):
        raise ValueError(f"{what}: the last row is {matrix[3]}: 0, 0, 0, 1 is meant (is the matrix transposed?)")
    return matrix


def size(value: Any) -> tuple[int, int]:
    """Width and height, pixels."""
    if value is None:
        raise ValueError("size: width and height in pixels are meant, e.g. (640, 480)")
    width, height = array(value, (2,), "size", np.int64).tolist()
    if not (0 < width < 2**31 and 0 < height < 2**31):
        raise ValueError(f"size: {width} x {height}: width and height above 0 are meant, pixels")
    return width, height


def linear(srgb: np.ndarray) -> np.ndarray:
    """Linear values of sRGB-encoded ones from 0 to 1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
