"""Code for pyrender: the steps of its own examples."""

import numpy as np
import pytest
from conftest import at

import lanternfish.pyrender as pyrender

trimesh = pytest.importorskip("trimesh")


def scene_of_a_box_and_a_ball():
    scene = pyrender.Scene(bg_color=(0, 0, 1, 1), ambient_light=(0.2, 0.2, 0.2))
    material = pyrender.MetallicRoughnessMaterial(baseColorFactor=(1.0, 0.0, 0.0, 1.0), metallicFactor=0.0)
    box = pyrender.Mesh.from_trimesh(trimesh.creation.box((1, 1, 1)), material, smooth=False)
    box = scene.add(box, pose=at(-1, 0, 0))
    ball = pyrender.Node(name="ball", mesh=pyrender.Mesh.from_trimesh(trimesh.creation.icosphere()))
    arm = pyrender.Node(matrix=at(1, 0, 0), children=[ball])
    scene.add_node(arm)
    scene.add(pyrender.DirectionalLight(color=np.ones(3), intensity=3.0), pose=at(0, 0, 5))
    scene.add(pyrender.SpotLight(intensity=10, range=20), parent_name="ball", pose=at(0, 0, 4))
    scene.add(pyrender.PerspectiveCamera(yfov=np.pi / 3), pose=at(0, 0, 4))
    return scene, box, ball, arm


def test_colour_depth_masks_and_flags():
    scene, box, ball, arm = scene_of_a_box_and_a_ball()
    renderer = pyrender.OffscreenRenderer(96, 64)
    color, depth = renderer.render(scene)
    assert color.shape == (64, 96, 3) and color.dtype == np.uint8 and depth.dtype == np.float32
    assert (color[0, 0] == (0, 0, 255)).all() and depth[0, 0] == 0
    x = 48 - int(32 / np.tan(np.pi / 6) / 3.5)
    assert abs(depth[32, x + 3] - 3.5) < 1e-3 and color[32, x + 3, 0] > 100 > 2 * color[32, x + 3, 1]
    seg, _ = renderer.render(scene, pyrender.RenderFlags.SEG, {box: (10, 0, 0), ball: (0, 20, 0)})
    assert {tuple(c) for c in seg.reshape(-1, 3).tolist()} == {(0, 0, 0), (10, 0, 0), (0, 20, 0)}
    assert (depth > 0).sum() == (seg.sum(-1) > 0).sum()
    assert (renderer.render(scene, pyrender.RenderFlags.DEPTH_ONLY) == depth).all()
    rgba, _ = renderer.render(scene, pyrender.RenderFlags.RGBA)
    assert rgba[0, 0, 3] == 0 and rgba[32, x + 3, 3] == 255
    flat, _ = renderer.render(scene, pyrender.RenderFlags.FLAT | pyrender.RenderFlags.SHADOWS_ALL)
    assert (flat[32, x + 3] == (255, 0, 0)).all() and (flat[0, 0] == (0, 0, 255)).all()
    # A parent moves its children; the scene is not uploaded again.
    made = renderer._renderer
    scene.set_pose(arm, at(1, 1, 0))
    renderer.render(scene)
    seg, _ = renderer.render(scene, pyrender.RenderFlags.SEG, {ball: (0, 20, 0)})
    assert np.nonzero(seg[..., 1])[0].mean() < 24 and np.allclose(scene.get_pose(ball), at(1, 1, 0))
    assert made is not None and scene.get_nodes(name="ball") == {ball} and scene.mesh_nodes == {box, ball}
    scene.remove_node(arm)
    assert scene.mesh_nodes == {box} and (renderer.render(scene)[1][:, 60:] == 0).all()
    with pytest.raises(ValueError, match="wireframes"):
        renderer.render(scene, pyrender.RenderFlags.ALL_WIREFRAME)
    renderer.delete()


def test_intrinsics_and_parallel_rays():
    scene = pyrender.Scene.from_trimesh_scene(trimesh.Scene(trimesh.creation.box((1, 1, 1))))
    fx, fy = 100.0, 90.0
    camera = scene.add(pyrender.IntrinsicsCamera(fx, fy, 40.0, 30.0), pose=at(0, 0, 4))
    renderer = pyrender.OffscreenRenderer(96, 64)
    rows, columns = np.nonzero(renderer.render(scene)[1])
    assert abs(columns.mean() + 0.5 - 40) < 0.5 and abs(rows.mean() + 0.5 - 30) < 0.5
    assert abs(np.ptp(columns) + 1 - fx / 3.5) <= 1 and abs(np.ptp(rows) + 1 - fy / 3.5) <= 1
    scene.remove_node(camera)
    scene.add(pyrender.OrthographicCamera(1.5, 1.0), pose=at(0, 0, 4))
    depth = renderer.render(scene)[1]
    assert abs(np.ptp(np.nonzero(depth)[0]) + 1 - 32) <= 1 and abs(depth.max() - 3.5) < 1e-4
