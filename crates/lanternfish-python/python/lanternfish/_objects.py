"""Meshes, materials and lights."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Optional

import numpy as np

from . import _check

_TEXTURES = ("base_color_texture", "metallic_roughness_texture", "normal_texture", "emissive_texture")


@dataclass(frozen=True, eq=False)
class Material:
    """glTF's metallic-roughness material. Colours are linear Rec. 709; an emission is in nits.

    Textures are arrays of 8 bits, rows from the top, with 1, 3 or 4 channels, or what numpy makes such an array of (a PIL image). Those of
    base colour and emission are sRGB-encoded. Roughness is in the green channel, metallic in the blue one. Each multiplies its factor.
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
        factors = {name: getattr(self, name) for name in self.__dataclass_fields__ if name not in _TEXTURES}
        object.__setattr__(self, "_factors", _factors(factors))
        for name in _TEXTURES:
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _texture(getattr(self, name), name))


def _factors(given: dict[str, Any]) -> dict[str, Any]:
    """Properties of a material as the library takes them."""
    colors = {"base_color": 4, "emissive": 3}
    unknown = [name for name in given if name not in Material.__dataclass_fields__ or name in _TEXTURES]
    if unknown:
        raise ValueError(f"a material has no {unknown[0]!r} that can be set")

    def factor(name: str, value: Any) -> Any:
        if name in colors:
            return _check.color(value, name, colors[name])
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

    `vertices`: N x 3; `faces`: M x 3 indices, counter-clockwise seen from the front. `normals`: N x 3; without them each triangle is flat,
    or with `smooth`, each vertex has the mean of its triangles. `uv`: N x 2, origin top left. `colors`: N x 3 or 4 that multiply the base
    colour, linear from 0 to 1, or sRGB-encoded bytes.
    """

    vertices: Any
    faces: Any
    normals: Any = None
    uv: Any = None
    colors: Any = None
    material: Material = field(default_factory=Material)
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
    """What all lights have. `color` multiplies the strength."""

    def _raw(self) -> dict[str, Any]:
        get = lambda name, usual: getattr(self, name, usual)  # noqa: E731
        strength = np.array(_check.color(get("color", 1.0), "color")) * _check.number(getattr(self, self._STRENGTH), self._STRENGTH)
        if (strength < 0).any():
            raise ValueError(f"{self._STRENGTH} of a light: 0 or more is meant")
        direction = _check.vector(get("direction", (0, -1, 0)), "direction")
        if not any(direction):
            raise ValueError("direction: any length but 0 is meant")
        size = get("size", (get("radius", 1.0),) * 2)
        return {
            "name": self.name, "kind": self._KIND, "position": _check.vector(get("position", (0, 0, 0)), "position"),
            "direction": direction, "intensity": strength.tolist(), "range": get("range", None),
            "angles": [math.radians(get("inner_angle", 0.0)), math.radians(get("outer_angle", 45.0))],
            "size": _check.vector(size, "size", 2), "right": _check.vector(get("right", (1, 0, 0)), "right"),
        }


@dataclass(frozen=True)
class PointLight(Light):
    """Light from a point in all directions. `intensity`: candela. `range`: distance at which it ends, m."""

    position: Any
    intensity: float = 100.0
    color: Any = (1.0, 1.0, 1.0)
    range: Optional[float] = None
    name: str = ""
    _KIND, _STRENGTH = "point", "intensity"


@dataclass(frozen=True)
class SpotLight(Light):
    """Light in a cone around `direction`. `intensity`: candela on the axis. Angles from the axis, degrees."""

    position: Any
    direction: Any
    intensity: float = 100.0
    inner_angle: float = 0.0
    outer_angle: float = 45.0
    color: Any = (1.0, 1.0, 1.0)
    range: Optional[float] = None
    name: str = ""
    _KIND, _STRENGTH = "spot", "intensity"


@dataclass(frozen=True)
class DirectionalLight(Light):
    """Parallel light that travels along `direction`. `illuminance`: lux on a surface that faces it."""

    direction: Any
    illuminance: float = 3.0
    color: Any = (1.0, 1.0, 1.0)
    name: str = ""
    _KIND, _STRENGTH = "directional", "illuminance"


@dataclass(frozen=True)
class DiskLight(Light):
    """One side of a disk. `radiance`: nits."""

    position: Any
    direction: Any
    radius: float = 0.5
    radiance: float = 10.0
    color: Any = (1.0, 1.0, 1.0)
    name: str = ""
    _KIND, _STRENGTH = "disk", "radiance"


@dataclass(frozen=True)
class RectangleLight(Light):
    """One side of a rectangle: `size` is its width along `right` and its height, m. `radiance`: nits."""

    position: Any
    direction: Any
    right: Any
    size: Any = (1.0, 1.0)
    radiance: float = 10.0
    color: Any = (1.0, 1.0, 1.0)
    name: str = ""
    _KIND, _STRENGTH = "rectangle", "radiance"


def light_of(raw: dict[str, Any]) -> Light:
    strength = max(raw["intensity"]) or 1.0
    common = {"color": tuple(c / strength for c in raw["intensity"]), "name": raw["name"]}
    position, direction = tuple(raw["position"]), tuple(raw["direction"])
    inner, outer = (math.degrees(angle) for angle in raw["angles"])
    kind = raw["kind"]
    if kind == "point":
        return PointLight(position, strength, range=raw["range"], **common)
    if kind == "spot":
        return SpotLight(position, direction, strength, inner, outer, range=raw["range"], **common)
    if kind == "directional":
        return DirectionalLight(direction, strength, **common)
    if kind == "disk":
        return DiskLight(position, direction, raw["size"][0], strength, **common)
    return RectangleLight(position, direction, tuple(raw["right"]), tuple(raw["size"]), strength, **common)
