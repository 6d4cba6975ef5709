"""Scenes of trimesh."""

from __future__ import annotations

from typing import Any

import numpy as np

from ._objects import Material, Mesh
from ._scene import Scene


def scene_of(scene: Scene, source: Any, smooth: bool) -> Scene:
    """Adds a `trimesh.Trimesh` or `trimesh.Scene`."""
    if hasattr(source, "graph"):
        meshes: dict[str, list[Mesh]] = {}
        for node in source.graph.nodes_geometry:
            pose, geometry = source.graph[node]
            if not hasattr(source.geometry[geometry], "faces"):
                continue
            if geometry not in meshes:
                meshes[geometry] = [mesh_of(source.geometry[geometry], smooth)]
            scene.add(meshes[geometry][0], pose=pose, name=str(node))
        return scene
    if not hasattr(source, "faces"):
        raise ValueError(f"a trimesh.Trimesh or trimesh.Scene is meant, not {type(source).__name__}")
    scene.add(mesh_of(source, smooth))
    return scene


def mesh_of(source: Any, smooth: bool, material: Material | None = None) -> Mesh:
    """A mesh with its visuals: a texture, or colours of vertices or faces; `material` replaces them."""
    visual: Any = getattr(source, "visual", None)
    kind = getattr(visual, "kind", None)
    uv = getattr(visual, "uv", None) if kind == "texture" else None
    vertices, faces, colors = np.asarray(source.vertices), np.asarray(source.faces), None
    normals = np.asarray(source.vertex_normals) if smooth else None
    if material is None and kind == "texture":
        material = _material(visual.material)
    elif material is None and kind == "vertex":
        colors = np.asarray(visual.vertex_colors)
    elif material is None and kind == "face":
        # Each face has vertices of its own.
        colors = np.repeat(np.asarray(visual.face_colors), 3, axis=0)
        vertices, faces = vertices[faces.reshape(-1)], np.arange(3 * len(faces)).reshape(-1, 3)
        normals, uv = (normals[source.faces.reshape(-1)] if normals is not None else None), None
    if uv is not None and len(uv) == len(vertices):
        # trimesh has the origin at the bottom left.
        uv = np.stack([uv[:, 0], 1 - uv[:, 1]], axis=1)
    else:
        uv = None
    name = str(getattr(source, "metadata", {}).get("name", ""))
    return Mesh(vertices, faces, normals, uv, colors, material or Material(), False, name)


def _material(source: Any) -> Material:
    """Of a `PBRMaterial` or a `SimpleMaterial`."""
    def texture(name: str) -> Any:
        image = getattr(source, name, None)
        return None if image is None else np.asarray(image.convert("RGBA"))

    def usual(name: str, value: Any) -> Any:
        given = getattr(source, name, None)
        return value if given is None else given

    if not hasattr(source, "baseColorFactor"):
        # The texture of a simple material replaces its colour.
        image = texture("image")
        color = np.ones(4) if image is not None else np.asarray(usual("diffuse", (255, 255, 255, 255))) / 255.0
        return Material(base_color=color, base_color_texture=image, name=str(usual("name", "")))
    color = np.asarray(usual("baseColorFactor", (1.0, 1.0, 1.0, 1.0)), dtype=float)
    color = color / 255.0 if color.max() > 1 else color
    return Material(
        base_color=color, metallic=usual("metallicFactor", 1.0), roughness=usual("roughnessFactor", 1.0),
        emissive=usual("emissiveFactor", (0.0, 0.0, 0.0)), alpha_mode=str(usual("alphaMode", "opaque")).lower(),
        alpha_cutoff=usual("alphaCutoff", 0.5), double_sided=bool(usual("doubleSided", False)),
        base_color_texture=texture("baseColorTexture"), metallic_roughness_texture=texture("metallicRoughnessTexture"),
        normal_texture=texture("normalTexture"), emissive_texture=texture("emissiveTexture"),
        name=str(usual("name", "")))
