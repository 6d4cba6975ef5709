"""Cameras."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from . import _check

# From the axes of OpenCV (x right, y down, z ahead) to those of OpenGL (x right, y up, z behind).
_AXES = {"opengl": np.eye(4), "opencv": np.diag([1.0, -1.0, -1.0, 1.0])}


@dataclass(frozen=True)
class Camera:
    """A camera. `pose` is the 4 x 4 matrix that maps it to the world: rotation and translation, m, +y up.

    OpenGL's cameras look along -z with y up, OpenCV's along z with y down: see `convention`. Extrinsics of OpenCV,
    which map the world to the camera, are the inverse of the pose. The far plane is at infinity.
    """

    pose: Any = None
    #: Full vertical angle of view, degrees.
    fov_y: float | None = 45.0
    #: Distance of the near plane, m; None: one that suits the scene.
    near: float | None = None
    #: Axes of `pose`: "opengl" or "opencv". The attribute `pose` is OpenGL's in either case.
    convention: str = "opengl"
    name: str = ""
    #: Width and height, pixels, if the camera was calibrated for an image.
    size: tuple[int, int] | None = None
    _slopes: Any | None = field(default=None, repr=False)
    _orthographic: Any | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.convention not in _AXES:
            raise ValueError(f"convention {self.convention!r}: expected opengl or opencv")
        pose = _check.pose(self.pose, "pose of a camera")
        object.__setattr__(self, "pose", pose @ _AXES[self.convention])
        object.__setattr__(self, "convention", "opengl")
        if self.fov_y is not None and not 0 < _check.number(self.fov_y, "fov_y") < 180:
            raise ValueError(f"fov_y is {self.fov_y}: degrees between 0 and 180 are meant")

    @classmethod
    def look_at(cls, eye: Any, target: Any, fov_y: float = 45.0, up: Any = (0, 1, 0), **more: Any) -> "Camera":
        """A camera at `eye` that looks at `target`. `up`: the direction that is up in the image, where possible."""
        named = (("eye", eye), ("target", target), ("up", up))
        eye, target, up = (np.array(_check.vector(value, what)) for what, value in named)
        length = np.linalg.norm(eye - target)
        if length == 0 or not up.any():
            raise ValueError(f"eye and target are both {eye.tolist()}: they must differ, and up must not be 0")
        back = (eye - target) / length
        if np.linalg.norm(np.cross(up, back)) < 1e-6 * np.linalg.norm(up):
            up = np.array((0, 0, -1.0)) if abs(back[1]) > 0.5 else np.array((0, 1.0, 0))
        right = np.cross(up, back)
        right /= np.linalg.norm(right)
        pose = np.eye(4)
        pose[:3] = np.stack([right, np.cross(back, right), back, eye], axis=1)
        return cls(pose, fov_y, **more)

    @classmethod
    def from_intrinsics(
        cls, fx: float, fy: float, cx: float, cy: float, size: tuple[int, int], pose: Any = None,
        convention: str = "opencv", near: float | None = None, name: str = "",
    ) -> "Camera":
        """A calibrated camera: focal lengths and principal point, pixels from the image's top left corner, for an image
        of this size.

        The centre of the first pixel is at (0.5, 0.5). Where your calibration has it at (0, 0), as OpenCV's does, add
        0.5 to cx and cy.
        """
        width, height = _size(size)
        fx, fy, cx, cy = _check.vector([fx, fy, cx, cy], "fx, fy, cx, cy", 4)
        if fx <= 0 or fy <= 0:
            raise ValueError(f"fx is {fx} and fy is {fy}: focal lengths above 0 are meant, pixels")
        slopes = [-cx / fx, (width - cx) / fx, (cy - height) / fy, cy / fy]
        return cls(pose, None, near, convention, name, (width, height), slopes)

    @classmethod
    def orthographic(
        cls, pose: Any, half_height: float, near: float = 0.0, far: float = 1000.0, convention: str = "opengl",
    ) -> "Camera":
        """A camera with parallel rays. `half_height`: half the height of its view, m."""
        numbers = _check.vector([half_height, near, far], "orthographic")
        return cls(pose, None, None, convention, "", None, None, numbers)

    def moved(self, pose: Any, convention: str = "opengl") -> "Camera":
        """The same camera with another pose."""
        return replace(self, pose=pose, convention=convention)

    def intrinsics(self, size: tuple[int, int] | None = None) -> np.ndarray:
        """The 3 x 3 matrix K of an image of this size: focal lengths and principal point, pixels."""
        width, height = _size(size or self.size)
        if self._orthographic is not None:
            raise ValueError("an orthographic camera has no focal length")
        if self._slopes is not None:
            left, right, bottom, top = self._slopes
        else:
            top = math.tan(0.5 * math.radians(self.fov_y or 45.0))
            left, right, bottom = -top * width / height, top * width / height, -top
        fx, fy = width / (right - left), height / (top - bottom)
        return np.array([[fx, 0, -left * fx], [0, fy, top * fy], [0, 0, 1]])


def _size(size: Any) -> tuple[int, int]:
    if size is None:
        raise ValueError("size: width and height in pixels are meant, e.g. (640, 480)")
    width, height = _check.array(size, (2,), "size", np.int64).tolist()
    if not (0 < width < 2**31 and 0 < height < 2**31):
        raise ValueError(f"size: {width} x {height}: width and height above 0 are meant, pixels")
    return width, height
