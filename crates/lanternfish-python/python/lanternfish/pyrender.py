"""The names of pyrender, for code that has them: `import lanternfish.pyrender as pyrender`.

Images are traced: shadows and indirect light are always there, and `ambient_light` is a sky. Colours are those of
exposure 0 without a tone map, as of pyrender. A depth of 0 is the background. Points, wireframes, skins and the viewer
are not there.
"""

import math
import numpy as np

import lanternfish as lf

from . import _check, _trimesh


class RenderFlags:
    """Flags of `OffscreenRenderer.render`. SEG, FLAT, DEPTH_ONLY and RGBA have pyrender's effect, shadows' none."""

    NONE, DEPTH_ONLY, OFFSCREEN, FLIP_WIREFRAME, ALL_WIREFRAME, ALL_SOLID = 0, 1, 2, 4, 8, 16
    SHADOWS_DIRECTIONAL, SHADOWS_POINT, SHADOWS_SPOT, SHADOWS_ALL = 32, 64, 128, 224
    VERTEX_NORMALS, FACE_NORMALS, SKIP_CULL_FACES, RGBA, FLAT, SEG = 256, 512, 1024, 2048, 4096, 8192
    _REFUSED = FLIP_WIREFRAME | ALL_WIREFRAME | VERTEX_NORMALS | FACE_NORMALS


class Texture:
    """An image for a material: an array or an image of PIL."""

    def __init__(self, name=None, sampler=None, source=None, source_channels=None, width=None, height=None):
        self.name, self.source = name, source


def MetallicRoughnessMaterial(
    name=None, normalTexture=None, occlusionTexture=None, emissiveTexture=None, emissiveFactor=(0.0, 0.0, 0.0),
    alphaMode="OPAQUE", alphaCutoff=None, doubleSided=False, smooth=True, wireframe=False, baseColorFactor=(1.0, 1.0,
    1.0), baseColorTexture=None, metallicFactor=1.0, roughnessFactor=1.0, metallicRoughnessTexture=None,
):
    """A material; textures are arrays, images, or have a `source`."""
    def texture(given):
        return None if given is None else np.asarray(getattr(given, "source", given))

    color = np.asarray((1.0, 1.0, 1.0) if baseColorFactor is None else baseColorFactor)
    return lf.Material(
        color / 255 if color.dtype.kind in "iu" and color.max() > 1 else color, metallicFactor, roughnessFactor,
        (0.0, 0.0, 0.0) if emissiveFactor is None else emissiveFactor, alphaMode.lower(),
        0.5 if alphaCutoff is None else alphaCutoff, doubleSided, base_color_texture=texture(baseColorTexture),
        metallic_roughness_texture=texture(metallicRoughnessTexture), normal_texture=texture(normalTexture),
        emissive_texture=texture(emissiveTexture), name=name or "")


class Mesh:
    """Parts that move together."""

    def __init__(self, primitives, name=None, is_visible=True, poses=None):
        self.primitives, self.name, self.is_visible = primitives, name, is_visible
        self.poses = [np.eye(4)] if poses is None else list(np.asarray(poses, dtype=float).reshape(-1, 4, 4))

    @staticmethod
    def from_trimesh(mesh, material=None, is_visible=True, poses=None, wireframe=False, smooth=True):
        if wireframe:
            raise ValueError("wireframe: surfaces are rendered alone")
        parts = mesh if isinstance(mesh, (list, tuple)) else [mesh]
        return Mesh([_trimesh.mesh_of(part, smooth, material) for part in parts], None, is_visible, poses)


class _Camera:
    """A camera without a place: `make` gives the one of a pose and a size."""

    def __init__(self, make, zfar, name):
        self.make, self.zfar, self.name = make, zfar, name


def PerspectiveCamera(yfov, znear=0.05, zfar=None, aspectRatio=None, name=None):
    def make(pose, size):
        fy = 0.5 * size[1] / math.tan(0.5 * yfov)
        fx = fy * size[0] / (size[1] * aspectRatio) if aspectRatio else fy
        return lf.Camera.from_intrinsics(fx, fy, 0.5 * size[0], 0.5 * size[1], size, pose, "opengl", znear)

    return _Camera(make, zfar, name)


def IntrinsicsCamera(fx, fy, cx, cy, znear=0.05, zfar=100.0, name=None):
    made = lf.Camera.from_intrinsics
    return _Camera(lambda pose, size: made(fx, fy, cx, cy, size, pose, "opengl", znear), zfar, name)


def OrthographicCamera(xmag, ymag, znear=0.05, zfar=100.0, name=None):
    return _Camera(lambda pose, size: lf.Camera.orthographic(pose, ymag, znear, zfar), zfar, name)


class Light:
    """A light without a place; it shines along its -z axis."""

    kind = "point"

    def __init__(
        self, color=None, intensity=None, range=None, innerConeAngle=0.0, outerConeAngle=math.pi / 4, name=None,
    ):
        self.color = np.ones(3) if color is None else np.asarray(color, dtype=float)[:3]
        self.intensity, self.range, self.name = 1.0 if intensity is None else intensity, range, name
        self.innerConeAngle, self.outerConeAngle = innerConeAngle, outerConeAngle

    def light(self, pose):
        angles = np.degrees((self.innerConeAngle, self.outerConeAngle))
        return lf.Light(self.kind, self.intensity * self.color, pose[:3, 3], -pose[:3, 2], self.range, angles)


class PointLight(Light):
    """Candela."""


class SpotLight(Light):
    """Candela; angles in radians."""

    kind = "spot"


class DirectionalLight(Light):
    """Lux."""

    kind = "directional"


class Node:
    """A place with an object, relative to its parent."""

    def __init__(self, name=None, camera=None, children=None, light=None, mesh=None, matrix=None, translation=None):
        self.name, self.camera, self.light, self.mesh, self.children = name, camera, light, mesh, list(children or ())
        self.matrix = np.eye(4) if matrix is None else np.array(matrix, dtype=float)
        if translation is not None:
            self.matrix[:3, 3] = translation


class Scene:
    """A tree of nodes."""

    def __init__(self, nodes=(), bg_color=None, ambient_light=None, name=None):
        self.bg_color = np.ones(4) if bg_color is None else np.asarray(bg_color, dtype=float)
        self.ambient_light = np.zeros(3) if ambient_light is None else np.asarray(ambient_light, dtype=float)[:3]
        self.name, self._roots, self.main_camera_node = name, [], None
        for node in nodes or ():
            self.add_node(node)

    @staticmethod
    def from_trimesh_scene(trimesh_scene, bg_color=None, ambient_light=None):
        scene = Scene((), bg_color, ambient_light)
        for name in trimesh_scene.graph.nodes_geometry:
            pose, geometry = trimesh_scene.graph[name]
            scene.add(Mesh.from_trimesh(trimesh_scene.geometry[geometry]), name=str(name), pose=pose)
        return scene

    def _placed(self):
        """All nodes, with world from node."""
        placed, waiting = {}, [(node, np.eye(4)) for node in self._roots]
        while waiting:
            node, parent = waiting.pop()
            placed[node] = parent @ node.matrix
            waiting.extend((child, placed[node]) for child in node.children)
        return placed

    nodes = property(lambda self: set(self._placed()))
    mesh_nodes = property(lambda self: {node for node in self.nodes if node.mesh})
    camera_nodes = property(lambda self: {node for node in self.nodes if node.camera})
    light_nodes = property(lambda self: {node for node in self.nodes if node.light})

    def add(self, obj, name=None, pose=None, parent_node=None, parent_name=None):
        kinds = {Mesh: "mesh", _Camera: "camera", Light: "light"}
        role = next((role for kind, role in kinds.items() if isinstance(obj, kind)), None)
        if role is None:
            raise TypeError(f"a Mesh, a camera or a light is meant, not {type(obj).__name__}")
        if parent_name is not None:
            parent_node = next(iter(self.get_nodes(name=parent_name)))
        node = Node(name=name or obj.name, matrix=pose, **{role: obj})
        self.add_node(node, parent_node)
        return node

    def add_node(self, node, parent_node=None):
        (self._roots if parent_node is None else parent_node.children).append(node)
        self.main_camera_node = self.main_camera_node or (node if node.camera else None)

    def remove_node(self, node):
        for siblings in [self._roots] + [other.children for other in self.nodes]:
            if node in siblings:
                siblings.remove(node)
        if node is self.main_camera_node:
            self.main_camera_node = next(iter(self.camera_nodes), None)

    def get_nodes(self, node=None, name=None, obj=None):
        def is_wanted(n):
            return node in (None, n) and name in (None, n.name) and obj in (None, n.mesh, n.camera, n.light)

        return {n for n in self.nodes if is_wanted(n)}

    def get_pose(self, node):
        return self._placed()[node]

    def set_pose(self, node, pose):
        """Sets the pose relative to the node's parent, as pyrender does."""
        node.matrix = np.array(pose, dtype=float)


class OffscreenRenderer:
    """Renders scenes to arrays. `settings`: those of `lanternfish.Renderer`."""

    def __init__(self, viewport_width, viewport_height, point_size=1.0, quality="draft", **settings):
        self.viewport_width, self.viewport_height = viewport_width, viewport_height
        self._settings = {"exposure": 0, "tone_map": "none", **settings, "quality": quality, "light_rig": "none"}
        self._renderer = None

    def render(self, scene, flags=0, seg_node_map=None):
        """Colour and depth; with DEPTH_ONLY the depth alone."""
        if flags & RenderFlags._REFUSED:
            raise ValueError("wireframes and normals as lines are not rendered")
        eye = scene.main_camera_node
        if eye is None:
            raise ValueError("the scene has no camera: add one")
        placed = scene._placed()
        parts = [(node, pose @ own, part) for node, pose in placed.items() if node.mesh and node.mesh.is_visible
                 for own in node.mesh.poses for part in node.mesh.primitives]
        renderer = self._prepared(scene, flags, parts, [n.light.light(pose) for n, pose in placed.items() if n.light])
        size, is_flat = (self.viewport_width, self.viewport_height), flags & RenderFlags.FLAT
        color = "instance" if flags & RenderFlags.SEG else "albedo" if is_flat else "rgba"
        outputs = ("depth",) if flags & RenderFlags.DEPTH_ONLY else ("depth", color)
        images = renderer.render(eye.camera.make(placed[eye], size), size, outputs)
        depth = images["depth"]
        if eye.camera.zfar is not None:
            depth = np.where(depth > eye.camera.zfar, 0, depth)
        if flags & RenderFlags.DEPTH_ONLY:
            return depth
        if flags & RenderFlags.SEG:
            colors = [np.zeros(3)] + [(seg_node_map or {}).get(node, np.zeros(3)) for node, _, _ in parts]
            return np.asarray(colors).astype(np.uint8)[images["instance"]], depth
        if is_flat:
            linear = np.where(depth[..., None] > 0, images["albedo"], _check.linear(scene.bg_color[:3]))
            shown = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
            return (255 * shown.clip(0, 1) + 0.5).astype(np.uint8), depth
        return images[color][..., : 4 if flags & RenderFlags.RGBA else 3], depth

    def _prepared(self, scene, flags, parts, lights):
        """A renderer of this scene: the last one, if only poses and lights differ."""
        behind = "#" + (255 * scene.bg_color[:3].clip(0, 1) + 0.5).astype(np.uint8).tobytes().hex()
        background = "transparent" if flags & RenderFlags.RGBA else behind
        key = [(node, part) for node, _, part in parts], background, scene.ambient_light.tolist()
        if self._renderer is None or key != self._key:
            self.delete()
            made = lf.Scene()
            for node, pose, part in parts:
                made.add(part, pose=pose, name=node.name or "")
            made.lights = lights
            if scene.ambient_light.any():
                made.set_sky(scene.ambient_light)
            self._renderer, self._key = lf.Renderer(made, background=background, **self._settings), key
        else:
            self._renderer.set_poses({index + 1: pose for index, (_, pose, _) in enumerate(parts)})
            if lights != self._lights:
                self._renderer.set_lights(lights)
        self._lights = lights
        return self._renderer

    def delete(self):
        if self._renderer is not None:
            self._renderer.close()
        self._renderer = None
