"""Domain randomisation: one view under other lights and colours. lights.py FOLDER [COUNT]"""

import sys
from pathlib import Path

import numpy as np

import lanternfish as lf
from dataset import ball, box


def placed(x: float, y: float, z: float) -> np.ndarray:
    pose = np.eye(4)
    pose[:3, 3] = x, y, z
    return pose


def main(folder: str, count: str = "8", size: str = "320x240") -> None:
    random, out = np.random.default_rng(2), Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    scene = lf.Scene()
    materials = [lf.Material(name=name) for name in ("ball", "box", "floor")]
    scene.add(ball(material=materials[0]), pose=placed(-0.4, 0.3, 0))
    scene.add(box(material=materials[1]), pose=placed(0.4, 0.25, 0.2))
    scene.add(box(20, materials[2]), pose=placed(0, -10, 0))
    camera = lf.Camera.look_at((0.5, 1.2, 3), (0, 0.2, 0), fov_y=35)
    with lf.Renderer(scene, quality="draft", light_rig="none") as renderer:
        for number in range(int(count)):
            renderer.set_lights([
                lf.DirectionalLight(random.normal(size=3) - (0, 2, 1), random.uniform(1, 4), random.uniform(0.6, 1, 3)),
                lf.PointLight(random.uniform(-2, 2, 3) + (0, 3, 0), random.uniform(2, 20), random.uniform(0.4, 1, 3)),
            ])
            for material in ("ball", "box", "floor"):
                color, roughness = random.uniform(0.1, 0.9, 3), random.uniform(0.2, 0.9)
                renderer.set_material(material, base_color=color, roughness=roughness)
            renderer.exposure = "auto"
            image = renderer.render(camera, tuple(map(int, size.split("x"))))["rgb"]
            lf.write_png(out / f"{number:05}.png", image)


if __name__ == "__main__":
    main(*sys.argv[1:])
