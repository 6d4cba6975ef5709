"""An arm of three links whose poses change each step, with depth and optical flow. robot.py FOLDER [STEPS]"""

import sys
from pathlib import Path

import numpy as np

import lanternfish as lf
from dataset import box


# From a box of 0.5 m around the origin: 0.2 m thick, from the joint up.
LINK = np.array([(0.4, 0, 0, 0), (0, 1.8, 0, 0.45), (0, 0, 0.4, 0), (0, 0, 0, 1)])


def turned(angle: float, up: float) -> np.ndarray:
    """From a link to its parent: a rotation about z, at this height."""
    c, s = np.cos(angle), np.sin(angle)
    return np.array([(c, -s, 0, 0), (s, c, 0, up), (0, 0, 1, 0), (0, 0, 0, 1)])


def poses(time: float) -> dict:
    pose, found = np.eye(4), {}
    for index, speed in enumerate((0.3, 0.7, 1.1)):
        pose = pose @ turned(0.8 * np.sin(speed * time), 0.9 if index else 0.0)
        found[f"link {index}"] = pose @ LINK
    return found


def main(folder: str, steps: str = "10", size: str = "320x240") -> None:
    out, size = Path(folder), tuple(map(int, size.split("x")))
    out.mkdir(parents=True, exist_ok=True)
    scene, link = lf.Scene(), box()
    for name, pose in poses(0).items():
        scene.add(link, pose=pose, name=name)
    camera = lf.Camera.look_at((0, 1.5, 6), (0, 1.3, 0))
    with lf.Renderer(scene, quality="draft") as renderer:
        before = renderer.moment(camera)
        for step in range(int(steps)):
            renderer.set_poses(poses(0.3 * step))
            images = renderer.render(camera, size, ("rgb", "depth", "motion"), towards=before)
            before = renderer.moment(camera)
            lf.write_png(out / f"{step:05}.png", images["rgb"])
            np.savez_compressed(out / f"{step:05}.npz", depth=images["depth"], flow_to_last=images["motion"])


if __name__ == "__main__":
    main(*sys.argv[1:])
