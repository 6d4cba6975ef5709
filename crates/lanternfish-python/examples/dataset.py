"""A data set in COCO's form: images, and the mask, box and class of each object. dataset.py FOLDER [COUNT]"""

import json
import sys
from pathlib import Path

import numpy as np

import lanternfish as lf

CLASSES = {1: "ball", 2: "box"}


def ball(radius: float = 0.3, rings: int = 24, material: lf.Material = lf.Material()) -> lf.Mesh:
    v, u = np.mgrid[0 : rings + 1, 0 : 2 * rings + 1]
    theta, phi = np.pi * v / rings, np.pi * u / rings
    points = np.stack([np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1).reshape(-1, 3)
    corner = (v[:-1, :-1] * (2 * rings + 1) + u[:-1, :-1]).reshape(-1)
    right, below = corner + 1, corner + 2 * rings + 1
    faces = np.concatenate([np.stack([corner, below, right], 1), np.stack([right, below, below + 1], 1)])
    return lf.Mesh(radius * points, faces, points, material=material)


def box(size: float = 0.5, material: lf.Material = lf.Material()) -> lf.Mesh:
    corners = size * (np.mgrid[0:2, 0:2, 0:2].reshape(3, 8).T - 0.5)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return lf.Mesh(corners, [face for a, b, c, d in quads for face in ((a, b, c), (a, c, d))], material=material)


def runs(mask: np.ndarray) -> dict:
    """A mask as COCO's lengths of runs, column by column, beginning with zeros."""
    flat = np.concatenate([[0], mask.T.reshape(-1)])
    edges = np.concatenate([[0], np.flatnonzero(np.diff(flat)), [mask.size]])
    return {"size": list(mask.shape), "counts": np.diff(edges).tolist()}


def main(folder: str, count: str = "8", size: str = "320x240") -> None:
    random, out = np.random.default_rng(1), Path(folder)
    width, height = map(int, size.split("x"))
    out.mkdir(parents=True, exist_ok=True)
    scene, meshes = lf.Scene(), {1: ball(), 2: box()}
    for index in range(6):
        scene.add(meshes[1 + index % 2], name=f"object {index}", semantic=1 + index % 2)
    images, annotations = [], []
    with lf.Renderer(scene, quality="draft") as renderer:
        for number in range(int(count)):
            for id in scene.names:
                pose = np.eye(4)
                pose[:3, :3] = np.linalg.qr(random.normal(size=(3, 3)))[0]
                pose[:3, 3] = random.uniform(-1, 1, 3)
                renderer.set_pose(id, pose)
            camera = lf.Camera.look_at(random.normal(size=3) * (1, 0.3, 1) + (0, 1, 4), (0, 0, 0))
            rendered = renderer.render(camera, (width, height), ("rgb", "instance"))
            images.append({"id": number, "file_name": f"{number:05}.png", "width": width, "height": height})
            lf.write_png(out / images[-1]["file_name"], rendered["rgb"])
            for id, semantic in scene.classes.items():
                mask = rendered["instance"] == id
                if mask.any():
                    rows, columns = np.nonzero(mask)
                    x, y = int(columns.min()), int(rows.min())
                    annotations.append({
                        "id": len(annotations) + 1, "image_id": number, "category_id": semantic, "iscrowd": 0,
                        "bbox": [x, y, int(columns.max()) - x + 1, int(rows.max()) - y + 1],
                        "area": int(mask.sum()), "segmentation": runs(mask)})
    categories = [{"id": id, "name": name} for id, name in CLASSES.items()]
    coco = {"images": images, "annotations": annotations, "categories": categories}
    (out / "annotations.json").write_text(json.dumps(coco))


if __name__ == "__main__":
    main(*sys.argv[1:])
