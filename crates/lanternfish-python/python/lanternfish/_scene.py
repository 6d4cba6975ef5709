"""Scenes."""

from __future__ import annotations

import os
from dataclasses import asdict
from typing import Any

import numpy as np

from . import _check, _lanternfish
from ._camera import Camera, _size
from ._objects import _TEXTURES, Light, _factors, Material, Mesh

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
        self._meshes: dict[int, tuple[Mesh, int]] = {}
        self._materials: dict[int, tuple[Material, int]] = {}
        self._textures: dict[int, tuple[np.ndarray, int]] = {}

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
            mesh, name = self._mesh(what), what.name if name is None else name
            return self._data.add_instance(mesh, _check.pose(pose), name, _class(semantic))
        if pose is not None or semantic:
            raise ValueError("pose and semantic are of meshes: a light or a camera has its own place")
        if isinstance(what, Light):
            raw = asdict(what) | ({} if name is None else {"name": name})
            return self._data.add_light(raw)
        if isinstance(what, Camera):
            raw = what._raw() | ({} if name is None else {"name": name})
            return self._data.add_camera(raw, 0.01)
        raise ValueError(f"a Mesh, a light or a Camera is meant, not {type(what).__name__}")

    def _mesh(self, mesh: Mesh) -> int:
        # The mesh is kept, so that no other has its id().
        if id(mesh) not in self._meshes:
            material = self._material(mesh.material)
            index = self._data.add_mesh(
                mesh.vertices, mesh.faces, mesh.normals, mesh.uv, mesh.colors, material, mesh.smooth, mesh.name)
            self._meshes[id(mesh)] = (mesh, index)
        return self._meshes[id(mesh)][1]

    def _material(self, material: Material) -> int:
        if id(material) not in self._materials:
            textures: dict[str, int | None] = {}
            for slot in _TEXTURES:
                pixels = getattr(material, slot)
                if pixels is not None and id(pixels) not in self._textures:
                    self._textures[id(pixels)] = (pixels, self._data.add_texture(pixels, slot))
                textures[slot] = None if pixels is None else self._textures[id(pixels)][1]
            index = self._data.add_material(_factors(material) | textures)
            self._materials[id(material)] = (material, index)
        return self._materials[id(material)][1]

    def copy(self) -> "Scene":
        """A copy that may change by itself."""
        copy = Scene(self._data.copy())
        copy._meshes, copy._materials, copy._textures = dict(self._meshes), dict(self._materials), dict(self._textures)
        return copy

    @property
    def names(self) -> dict[int, str]:
        """Names of the instances by id."""
        return {index + 1: name for index, (name, _) in enumerate(self._data.instances())}

    @property
    def classes(self) -> dict[int, int]:
        """Semantic classes of the instances by id; 0: none."""
        return {index + 1: semantic for index, (_, semantic) in enumerate(self._data.instances())}

    @property
    def material_names(self) -> dict[int, str]:
        """Names of the materials by their numbers in the output `material`, from 1 on."""
        return {index + 1: name for index, name in enumerate(self._data.materials())}

    def _instance(self, which: int | str) -> int:
        return _found(which, [name for name, _ in self._data.instances()], 1, "instance") + 1

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
        return [Light(**raw) for raw in self._data.lights()]

    @lights.setter
    def lights(self, lights: list[Light]) -> None:
        self._data.set_lights([asdict(light) for light in lights])

    @property
    def cameras(self) -> list[Camera]:
        """The cameras, as copies."""
        return [Camera._of(raw) for raw in self._data.cameras()]

    def default_camera(self, size: tuple[int, int] = (640, 480)) -> Camera:
        """The first camera; without one, a camera that frames the scene in an image of this size."""
        width, height = _size(size)
        return Camera._of(self._data.default_camera(width / height))

    def set_sky(self, color: Any) -> None:
        """Radiance from everywhere, nits: light and background."""
        self._data.set_sky(_check.color(color, "sky"))

    def set_environment(self, path: Path, rotation: float = 0.0, scale: float = 1.0) -> None:
        """Light and background from an equirectangular image (.hdr or .exr). `rotation` about +y, degrees."""
        rotation, scale = _check.number(rotation, "rotation"), _check.number(scale, "scale")
        self._data.load_environment(os.fspath(path), float(np.radians(rotation)), scale)

    @property
    def animations(self) -> list[tuple[str, float]]:
        """Name and duration, s, of each animation."""
        return self._data.animations()

    def set_time(self, time: float, animation: int = 0) -> None:
        """Moves the scene to a time of an animation, s: instances, skins, lights and cameras."""
        _found(animation, [name for name, _ in self.animations], 0, "animation")
        self._data.set_time(animation, _check.number(time, "time"))

    @property
    def bounds(self) -> np.ndarray | None:
        """Least and greatest corner, 2 x 3, m; None without geometry."""
        bounds = self._data.bounds()
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
    return Scene(_lanternfish.SceneData.load(os.fspath(path), up, scene, variant))
