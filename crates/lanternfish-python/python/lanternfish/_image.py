"""PNG files, without a package for images."""

from __future__ import annotations

import os
import struct
import zlib
from typing import Any

import numpy as np


def png(pixels: Any) -> bytes:
    """A PNG file of 8-bit values, or 16-bit ones: rows x columns, or x 3 or 4 channels."""
    pixels = np.asarray(pixels)
    channels = 1 if pixels.ndim == 2 else pixels.shape[-1] if pixels.ndim == 3 else 0
    if pixels.dtype not in (np.uint8, np.uint16) or channels not in (1, 3, 4) or not pixels.size:
        meant = "8- or 16-bit values, rows x columns x 1, 3 or 4"
        raise ValueError(f"a PNG image has {meant}, not {pixels.dtype} of {pixels.shape}")
    height, width = pixels.shape[:2]
    rows = np.ascontiguousarray(pixels.astype(pixels.dtype.newbyteorder(">"))).view(np.uint8).reshape(height, -1)
    # Each row begins with the number of its filter: none.
    data = np.concatenate([np.zeros((height, 1), np.uint8), rows], axis=1).tobytes()
    header = struct.pack(">IIBBBBB", width, height, 8 * pixels.dtype.itemsize, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)

    def chunk(kind: bytes, content: bytes) -> bytes:
        return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))

    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(data, 4)) + chunk(b"IEND", b"")


def write_png(path: str | os.PathLike[str], pixels: Any) -> None:
    """Writes an image: 8 or 16 bits, grey, RGB or RGBA."""
    content = png(pixels)
    with open(path, "wb") as file:
        file.write(content)


class Images(dict[str, np.ndarray]):
    """The arrays of a rendering by name. A notebook shows the first image."""

    def _repr_png_(self) -> bytes | None:
        shown = self.get("rgba", self.get("rgb"))
        if shown is None:
            return None
        return png(shown if shown.ndim == 3 else shown[0])
