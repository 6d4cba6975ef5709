"""Lanternfish: images, depth, normals and masks of 3D scenes, with ray-traced light, on any GPU or none.

    import lanternfish as lf

    scene = lf.load("robot.glb")
    with lf.Renderer(scene, quality="draft") as renderer:
        images = renderer.render(size=(640, 480), outputs=("rgb", "depth", "normal", "instance"))

Units: metres, degrees, candela, lux, nits; colours are linear Rec. 709 unless said otherwise; +y is up.
Notes go to `logging.getLogger("lanternfish")`. Exceptions: `ValueError` for what a caller passed, `Error` for the rest.
"""

from ._image import Images, png, write_png
from ._lanternfish import OUTPUTS, Error, NoAdapter, __version__, settings
from ._objects import (
    Camera, DirectionalLight, DiskLight, Light, Material, Mesh, PointLight, RectangleLight, SpotLight,
)
from ._renderer import Renderer, compare, reference
from ._scene import Scene, load

__all__ = [
    "Camera", "DirectionalLight", "DiskLight", "Error", "Images", "Light", "Material", "Mesh", "NoAdapter", "OUTPUTS",
    "PointLight", "RectangleLight", "Renderer", "Scene", "SpotLight", "__version__", "compare", "load", "png",
    "reference", "settings", "write_png",
]
