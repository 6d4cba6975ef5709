"""Domain randomisation: one view under other lights and colours. lights.py FOLDER [COUNT]"""

import sys
from pathlib import Path

import numpy as np

import lanternfish as lf
from dataset import ball, box


def main(folder: str, count: str = "8", size: str = "320x240") -> None:
    random, out = np.random.default_rng(2), Path(folder)
    out.mkdir(parents=True, exist_ok=True)
    scene, floor = lf.Scene(), np.diag([20, 0.02, 20, 1.0])
    for mesh, pose in ((ball(), [-0.4, 0.3, 0]), (box(), [0.4, 0.25, 0.2])):
        scene.add(mesh, pose=np.block([[np.eye(3), np.reshape(pose, (3, 1))], [0, 0, 0, 1]]))
    scene.add(box(), pose=floor)
    camera = lf.Camera.look_at((0.5, 1.2, 3), (0, 0.2, 0), fov_y=35)
    with lf.Renderer(scene, quality="draft", light_rig="none") as renderer:
        for number in range(int(count)):
            renderer.set_lights([
                lf.DirectionalLight(random.normal(size=3) - (0, 2, 1), random.uniform(1, 4), random.uniform(0.6, 1, 3)),
                lf.PointLight(random.uniform(-2, 2, 3) + (0, 3, 0), random.uniform(2, 20), random.uniform(0.4, 1, 3)),
            ])
            for material in (1, 2, 3):
                color, roughness = random.uniform(0.1, 0.9, 3), random.uniform(0.2, 0.9)
                renderer.set_material(material, base_color=color, roughness=roughness)
            renderer.exposure = "auto"
            image = renderer.render(camera, tuple(map(int, size.split("x"))))["rgb"]
            lf.write_png(out / f"{number:05}.png", image)


if __name__ == "__main__":
    main(*sys.argv[1:])
