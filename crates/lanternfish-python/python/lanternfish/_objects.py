"""Cameras, meshes, materials and lights."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from . import _check

# From the axes of OpenCV (x right, y down, z ahead) to those of OpenGL (x right, y up, z behind).
_AXES = {"opengl": np.eye(4), "opencv": np.diag([1.0, -1.0, -1.0, 1.0])}
_TEXTURES = ("base_color_texture", "metallic_roughness_texture", "normal_texture", "emissive_texture")


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
        width, height = _check.size(size)
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
        width, height = _check.size(size or self.size)
        if self._orthographic is not None:
            raise ValueError("an orthographic camera has no focal length")
        if self._slopes is not None:
            left, right, bottom, top = self._slopes
        else:
            top = math.tan(0.5 * math.radians(self.fov_y or 45.0))
            left, right, bottom = -top * width / height, top * width / height, -top
        fx, fy = width / (right - left), height / (top - bottom)
        return np.array([[fx, 0, -left * fx], [0, fy, top * fy], [0, 0, 1]])


@dataclass(frozen=True, eq=False)
class Material:
    """glTF's metallic-roughness material. Colours are linear Rec. 709; an emission is in nits.

    Textures are arrays of 8 bits, rows from the top, with 1, 3 or 4 channels, or what numpy makes such an array of (a
    PIL image). Those of base colour and emission are sRGB-encoded. Roughness is in the green channel, metallic in the
    blue one. Each multiplies its factor.
    """

    base_color: Any = (1.0, 1.0, 1.0)
    metallic: float = 0.0
    roughness: float = 0.5
    emissive: Any = (0.0, 0.0, 0.0)
    #: "opaque", "mask" (a hole where alpha is below `alpha_cutoff`) or "blend".
    alpha_mode: str = "opaque"
    alpha_cutoff: float = 0.5
    double_sided: bool = True
    ior: float = 1.5
    #: Fraction of light that passes, 0 to 1: glass.
    transmission: float = 0.0
    #: Above 0, glass is solid and refracts; 0: a pane.
    thickness: float = 0.0
    clearcoat: float = 0.0
    #: True: the base colour is what is seen, without light.
    unlit: bool = False
    normal_scale: float = 1.0
    base_color_texture: Any = None
    metallic_roughness_texture: Any = None
    normal_texture: Any = None
    emissive_texture: Any = None
    name: str = ""

    def __post_init__(self) -> None:
        _factors(self)
        for name in _TEXTURES:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _texture(getattr(self, name), name))


def _factors(material: Material | dict[str, Any]) -> dict[str, Any]:
    """Properties of a material but its textures, as the library takes them."""
    names = [name for name in Material.__dataclass_fields__ if name not in _TEXTURES]
    given = material if isinstance(material, dict) else {name: getattr(material, name) for name in names}
    unknown = [name for name in given if name not in names]
    if unknown:
        raise ValueError(f"a material has no {unknown[0]!r} that can be set")

    def factor(name: str, value: Any) -> Any:
        if name in ("base_color", "emissive"):
            return _check.color(value, name, 4 if name == "base_color" else 3)
        if name in ("alpha_mode", "name"):
            return str(value)
        return bool(value) if name in ("double_sided", "unlit") else _check.number(value, name)

    return {name: factor(name, value) for name, value in given.items()}


def _texture(pixels: Any, what: str) -> np.ndarray:
    pixels = np.asarray(pixels)
    if pixels.dtype != np.uint8 or pixels.ndim not in (2, 3) or 0 in pixels.shape:
        raise ValueError(f"{what}: an array of 8-bit values, rows x columns x 1, 3 or 4 channels, is meant, "
                         f"not {pixels.dtype} of {pixels.shape}")
    pixels = pixels[..., None] if pixels.ndim == 2 else pixels
    if pixels.shape[2] not in (1, 3, 4):
        raise ValueError(f"{what}: 1, 3 or 4 channels are meant, not {pixels.shape[2]}")
    rgba = np.full(pixels.shape[:2] + (4,), 255, np.uint8)
    rgba[..., :3] = pixels[..., :3]
    if pixels.shape[2] == 4:
        rgba[..., 3] = pixels[..., 3]
    return rgba


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles of one material, in object space, m.

    `vertices`: N x 3; `faces`: M x 3 indices, counter-clockwise seen from the front. `normals`: N x 3; without them
    each triangle is flat, or with `smooth`, each vertex has the mean of its triangles. `uv`: N x 2, origin top left.
    `colors`: N x 3 or 4 that multiply the base colour, linear from 0 to 1, or sRGB-encoded bytes.
    """

    vertices: Any
    faces: Any
    normals: Any = None
    uv: Any = None
    colors: Any = None
    material: Material = Material()
    smooth: bool = False
    name: str = ""

    def __post_init__(self) -> None:
        def keep(name: str, value: np.ndarray) -> None:
            object.__setattr__(self, name, value)

        keep("vertices", _check.array(self.vertices, (None, 3), "vertices"))
        keep("faces", _check.array(self.faces, (None, 3), "faces", np.uint32))
        count = len(self.vertices)
        if not count or not len(self.faces):
            raise ValueError(f"a mesh of {count} vertices and {len(self.faces)} faces: at least one triangle is meant")
        if int(self.faces.max()) >= count:
            raise ValueError(f"faces: vertex {int(self.faces.max())} of {count} is referred to")
        if self.normals is not None:
            keep("normals", _check.array(self.normals, (count, 3), "normals"))
        if self.uv is not None:
            keep("uv", _check.array(self.uv, (count, 2), "uv"))
        if self.colors is not None:
            colors = np.asarray(self.colors)
            if colors.dtype == np.uint8:
                colors = colors / np.float64(255)
                colors[..., :3] = _check.linear(colors[..., :3])
            if colors.ndim == 2 and colors.shape[1] == 3:
                colors = np.concatenate([colors, np.ones((len(colors), 1))], axis=1)
            keep("colors", _check.array(colors, (count, 4), "colors"))
        if not isinstance(self.material, Material):
            raise ValueError(f"material: a Material is meant, not {type(self.material).__name__}")


@dataclass(frozen=True)
class Light:
    """A light: of `PointLight`, `SpotLight`, `DirectionalLight`, `DiskLight` or `RectangleLight`, or of a file."""

    kind: str
    #: Strength times colour, linear: candela, lux or nits.
    intensity: Any
    position: Any = (0.0, 0.0, 0.0)
    direction: Any = (0.0, -1.0, 0.0)
    range: float | None = None
    #: Inner and outer angle of a spot, from its axis, degrees.
    angles: Any = (0.0, 45.0)
    #: Width and height of a rectangle; twice the radius of a disk, m.
    size: Any = (1.0, 1.0)
    #: Direction of a rectangle's width.
    right: Any = (1.0, 0.0, 0.0)
    name: str = ""

    def __post_init__(self) -> None:
        for name in ("intensity", "position", "direction", "angles", "size", "right"):
            count = 2 if name in ("angles", "size") else 3
            object.__setattr__(self, name, tuple(_check.vector(getattr(self, name), f"{name} of a light", count)))
        if min(self.intensity) < 0:
            raise ValueError(f"intensity of a light: {self.intensity}: 0 or more is meant")
        if not any(self.direction):
            raise ValueError("direction of a light: any length but 0 is meant")


def _strength(value: Any, color: Any) -> Any:
    return np.array(_check.color(color, "color")) * _check.number(value, "strength of a light")


def PointLight(
    position: Any, intensity: float = 100.0, color: Any = 1.0, range: float | None = None, name: str = ""
) -> Light:
    """Light from a point in all directions. `intensity`: candela. `range`: distance at which it ends, m."""
    return Light("point", _strength(intensity, color), position, range=range, name=name)


def SpotLight(
    position: Any, direction: Any, intensity: float = 100.0, inner_angle: float = 0.0, outer_angle: float = 45.0,
    color: Any = 1.0, range: float | None = None, name: str = "",
) -> Light:
    """Light in a cone around `direction`. `intensity`: candela on the axis. Angles from the axis, degrees."""
    angles = (inner_angle, outer_angle)
    return Light("spot", _strength(intensity, color), position, direction, range, angles, name=name)


def DirectionalLight(direction: Any, illuminance: float = 3.0, color: Any = 1.0, name: str = "") -> Light:
    """Parallel light that travels along `direction`. `illuminance`: lux on a surface that faces it."""
    return Light("directional", _strength(illuminance, color), direction=direction, name=name)


def DiskLight(
    position: Any, direction: Any, radius: float = 0.5, radiance: float = 10.0, color: Any = 1.0, name: str = ""
) -> Light:
    """One side of a disk. `radiance`: nits."""
    return Light("disk", _strength(radiance, color), position, direction, size=(2 * radius,) * 2, name=name)


def RectangleLight(
    position: Any, direction: Any, right: Any, size: Any = (1.0, 1.0), radiance: float = 10.0, color: Any = 1.0,
    name: str = "",
) -> Light:
    """One side of a rectangle: `size` is its width along `right` and its height, m. `radiance`: nits."""
    return Light("rectangle", _strength(radiance, color), position, direction, None, size=size, right=right, name=name)
