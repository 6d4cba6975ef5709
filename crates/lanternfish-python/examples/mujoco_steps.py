"""A MuJoCo simulation, an image with masks every 30th of a second. mujoco_steps.py FOLDER [MODEL.xml] [IMAGES]

Needs `pip install mujoco trimesh`. MuJoCo moves the geoms; each becomes an instance whose pose changes without an upload.
"""

import sys
from pathlib import Path

import mujoco
import numpy as np
import trimesh

import lanternfish as lf

MODEL = """<mujoco><worldbody>
  <geom name="floor" type="plane" size="3 3 0.1" rgba="0.5 0.5 0.5 1"/>
  <body pos="0 0 1.2"><freejoint/><geom name="box" type="box" size="0.2 0.3 0.1" rgba="0.8 0.3 0.1 1" euler="40 20 0"/></body>
  <body pos="0.1 0.5 2"><freejoint/><geom name="ball" type="sphere" size="0.25" rgba="0.1 0.4 0.8 1"/></body>
  <body pos="-0.7 0 1.5"><joint type="hinge" axis="0 1 0"/>
    <geom name="arm" type="capsule" fromto="0 0 0 0.8 0 0" size="0.08" rgba="0.2 0.7 0.3 1"/></body>
</worldbody></mujoco>"""
# MuJoCo's z points up, Lanternfish's y.
UP = np.array([(1, 0, 0, 0), (0, 0, 1, 0), (0, -1, 0, 0), (0, 0, 0, 1)], float)


def shape(model: mujoco.MjModel, geom: int) -> trimesh.Trimesh:
    """The triangles of a geom, in its own frame."""
    x, y, z = model.geom_size[geom]
    kind, mesh = mujoco.mjtGeom(model.geom_type[geom]), model.geom_dataid[geom]
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
        face, faces = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
        return trimesh.Trimesh(model.mesh_vert[first : first + count], model.mesh_face[face : face + faces], process=False)
    return {
        mujoco.mjtGeom.mjGEOM_PLANE: lambda: trimesh.creation.box((2 * (x or 10), 2 * (y or 10), 1e-3)),
        mujoco.mjtGeom.mjGEOM_SPHERE: lambda: trimesh.creation.icosphere(4, x),
        mujoco.mjtGeom.mjGEOM_ELLIPSOID: lambda: trimesh.creation.icosphere(4).apply_scale((x, y, z)),
        mujoco.mjtGeom.mjGEOM_CAPSULE: lambda: trimesh.creation.capsule(2 * y, x),
        mujoco.mjtGeom.mjGEOM_CYLINDER: lambda: trimesh.creation.cylinder(x, 2 * y),
        mujoco.mjtGeom.mjGEOM_BOX: lambda: trimesh.creation.box((2 * x, 2 * y, 2 * z)),
    }[kind]()


def poses(data: mujoco.MjData) -> dict:
    found = np.tile(np.eye(4), (len(data.geom_xpos), 1, 1))
    found[:, :3, :3], found[:, :3, 3] = data.geom_xmat.reshape(-1, 3, 3), data.geom_xpos
    return {index + 1: UP @ pose for index, pose in enumerate(found)}


def main(folder: str, path: str = "", images: str = "60", size: str = "320x240") -> None:
    out, size = Path(folder), tuple(map(int, size.split("x")))
    out.mkdir(parents=True, exist_ok=True)
    model = mujoco.MjModel.from_xml_path(path) if path else mujoco.MjModel.from_xml_string(MODEL)
    data, scene = mujoco.MjData(model), lf.Scene()
    mujoco.mj_forward(model, data)
    for id, pose in poses(data).items():
        triangles = shape(model, id - 1)
        material = lf.Material(model.geom_rgba[id - 1, :3], roughness=0.5)
        smooth = model.geom_type[id - 1] not in (mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_PLANE)
        mesh = lf.Mesh(triangles.vertices, triangles.faces, material=material, smooth=bool(smooth))
        scene.add(mesh, pose=pose, name=model.geom(id - 1).name or f"geom {id}", semantic=int(model.geom_bodyid[id - 1]))
    scene.add(lf.DirectionalLight((-1, -2, -1), 3))
    scene.set_sky((0.4, 0.5, 0.7))
    camera = lf.Camera.look_at((3, 2.2, 3), (0, 0.5, 0))
    with lf.Renderer(scene, quality="draft") as renderer:
        for image in range(int(images)):
            while data.time < image / 30:
                mujoco.mj_step(model, data)
            renderer.set_poses(poses(data))
            found = renderer.render(camera, size, ("rgb", "depth", "instance"))
            lf.write_png(out / f"{image:05}.png", found["rgb"])
            np.savez_compressed(out / f"{image:05}.npz", depth=found["depth"], instance=found["instance"])


if __name__ == "__main__":
    main(*sys.argv[1:])
