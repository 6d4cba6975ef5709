"""Scenes."""

from __future__ import annotations

import math
import os
from dataclasses import replace
from typing import Any, Callable

import numpy as np

from . import _check, _lanternfish
from ._objects import _TEXTURES, Camera, Light, _factors, Material, Mesh

Path = str | os.PathLike[str]


def _found(which: int | str, names: list[str], first: int, what: str) -> int:
    """The index of an object by its number from `first` on, or by its name."""
    if isinstance(which, (int, np.integer)) and not isinstance(which, bool):
        if not first <= which < first + len(names):
            raise ValueError(f"there is no {what} {which}: {len(names)} are numbered from {first} on")
        return int(which) - first
    found = [index for index, name in enumerate(names) if name == which]
    if len(found) == 1:
        return found[0]
    if found:
        numbers = [index + first for index in found[:9]]
        raise ValueError(f"{len(found)} {what}s are called {which!r}: name one by its number, of {numbers}")
    raise ValueError(f"there is no {what} called {which!r}: there are {names[:20]}")


def _class(semantic: Any) -> int:
    return int(_check.array(semantic, (), "semantic", np.uint32))


class Scene:
    """Meshes, lights and cameras in a world with +y up, m.

    Instances have ids from 1 on, which are the values of the output `instance`; 0 is where there is none. A scene
    without light gets a light rig when it is rendered, and one without cameras is framed.
    """

    def __init__(self, _data: _lanternfish.SceneData | None = None) -> None:
        self._data = _data or _lanternfish.SceneData()
        self._names: list[str] = self._data.names
        self._added: dict[int, tuple[Any, int]] = {}

    @classmethod
    def from_trimesh(cls, mesh: Any, smooth: bool = True) -> "Scene":
        """The scene of a `trimesh.Trimesh` or `trimesh.Scene`: meshes with colours, textures and materials, and their
        places.
        """
        from ._trimesh import scene_of

        return scene_of(cls(), mesh, smooth)

    def add(self, what: Mesh | Light | Camera, pose: Any = None, name: str | None = None, semantic: int = 0) -> int:
        """Adds a mesh, a light or a camera.

        Returns the id of the mesh's instance (from 1 on), or the index of the light or camera (from 0 on). `pose`: 4 x
        4, world from object, of a mesh. A mesh that is added again is an instance of the same data. `semantic`: its
        class in the output `semantic`.
        """
        if isinstance(what, Mesh):
            mesh, name = self._index(what, self._mesh), what.name if name is None else name
            id = self._data.add_instance(mesh, _check.pose(pose), name, _class(semantic))
            self._names.append(name)
            return id
        if pose is not None or semantic:
            raise ValueError("pose and semantic are of meshes: a light or a camera has its own place")
        if not isinstance(what, (Light, Camera)):
            raise ValueError(f"a Mesh, a light or a Camera is meant, not {type(what).__name__}")
        named = what if name is None else replace(what, name=name)
        return self._data.add_light(named) if isinstance(what, Light) else self._data.add_camera(named)

    def _index(self, what: Any, add: Callable[[Any], int]) -> int:
        """The index of a mesh, material or texture. What was added is kept, so that nothing else has its id()."""
        if id(what) not in self._added:
            self._added[id(what)] = (what, add(what))
        return self._added[id(what)][1]

    def _mesh(self, mesh: Mesh) -> int:
        return self._data.add_mesh(mesh, self._index(mesh.material, self._material))

    def _material(self, material: Material) -> int:
        textures = {name: self._index(pixels, lambda pixels: self._data.add_texture(pixels, name))
                    for name in _TEXTURES if (pixels := getattr(material, name)) is not None}
        return self._data.add_material(_factors(material) | textures)

    def copy(self) -> "Scene":
        """A copy that may change by itself."""
        copy = Scene(self._data.copy())
        copy._added = dict(self._added)
        return copy

    @property
    def names(self) -> dict[int, str]:
        """Names of the instances by id."""
        return dict(enumerate(self._names, 1))

    @property
    def classes(self) -> dict[int, int]:
        """Semantic classes of the instances by id; 0: none."""
        return dict(enumerate(self._data.classes, 1))

    @property
    def material_names(self) -> dict[int, str]:
        """Names of the materials by their numbers in the output `material`, from 1 on."""
        return dict(enumerate(self._data.materials, 1))

    def _instance(self, which: int | str) -> int:
        return _found(which, self._names, 1, "instance") + 1

    def pose(self, which: int | str) -> np.ndarray:
        """World from object of an instance, by name or id."""
        return np.array(self._data.pose(self._instance(which)))

    def set_pose(self, which: int | str, pose: Any) -> None:
        """Moves an instance, by name or id. Renderers that exist keep theirs: see `Renderer.set_pose`."""
        self._data.set_pose(self._instance(which), _check.pose(pose))

    def set_class(self, which: int | str, semantic: int) -> None:
        """Sets the semantic class of an instance, by name or id."""
        self._data.set_semantic(self._instance(which), _class(semantic))

    @property
    def lights(self) -> list[Light]:
        """The lights, as copies."""
        return self._data.lights

    @lights.setter
    def lights(self, lights: list[Light]) -> None:
        self._data.lights = list(lights)

    @property
    def cameras(self) -> list[Camera]:
        """The cameras, as copies."""
        return self._data.cameras

    def default_camera(self, size: tuple[int, int] = (640, 480)) -> Camera:
        """The first camera; without one, a camera that frames the scene in an image of this size."""
        width, height = _check.size(size)
        return self._data.default_camera(width / height)

    def set_sky(self, color: Any) -> None:
        """Radiance from everywhere, nits: light and background."""
        self._data.set_sky(_check.color(color, "sky"))

    def set_environment(self, path: Path, rotation: float = 0.0, scale: float = 1.0) -> None:
        """Light and background from an equirectangular image (.hdr or .exr). `rotation` about +y, degrees."""
        rotation, scale = _check.number(rotation, "rotation"), _check.number(scale, "scale")
        self._data.load_environment(path, math.radians(rotation), scale)

    @property
    def animations(self) -> list[tuple[str, float]]:
        """Name and duration, s, of each animation."""
        return self._data.animations

    def set_time(self, time: float, animation: int = 0) -> None:
        """Moves the scene to a time of an animation, s: instances, skins, lights and cameras."""
        _found(animation, [name for name, _ in self.animations], 0, "animation")
        self._data.set_time(animation, _check.number(time, "time"))

    @property
    def bounds(self) -> np.ndarray | None:
        """Least and greatest corner, 2 x 3, m; None without geometry."""
        bounds = self._data.bounds
        return None if bounds is None else np.array(bounds)

    def _repr_png_(self) -> bytes | None:
        from ._renderer import Renderer

        with Renderer(self, quality="draft") as renderer:
            return renderer.render(size=(480, 360))._repr_png_()


def load(path: Path, *, up: str = "y", scene: str | None = None, variant: str | None = None) -> Scene:
    """Reads a glTF 2.0 file (.gltf, .glb) or a Wavefront file (.obj), or generates `demo:NAME`.

    `up`: the file's axis that points up, "y" or "z". `scene`: name or index of one of its scenes. `variant`: of its
    materials' variants.
    """
    return Scene(_lanternfish.SceneData.load(path, up, scene, variant))
