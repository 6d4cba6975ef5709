"""Outputs against geometry, the path tracer and the command line."""

import os
import subprocess

import numpy as np
import pytest
from conftest import SIZE, at, quad, rays, sphere

import lanternfish as lf

SURFACES = ("depth", "distance", "position", "normal", "albedo", "instance", "material", "semantic")


def test_a_sphere_on_a_plane_is_as_computed(ball_and_plane):
    camera = lf.Camera.look_at((2, 2, 4), (0, 0.8, 0), fov_y=50)
    with lf.Renderer(ball_and_plane, indirect="none") as renderer:
        out = renderer.render(camera, SIZE, SURFACES)
    eye, direction = rays(camera)
    to_ball = eye - (0, 1, 0)
    a, b, c = (direction**2).sum(-1), direction @ to_ball, to_ball @ to_ball - 1
    discriminant = b * b - a * c
    ball = np.where(discriminant > 0, (-b - np.sqrt(np.maximum(discriminant, 0))) / a, np.inf)
    plane = np.where(direction[..., 1] < 0, -eye[1] / np.minimum(direction[..., 1], -1e-9), np.inf)
    plane[(np.abs(eye + plane[..., None] * direction)[..., ::2] > 20).any(-1)] = np.inf
    depth = np.minimum(ball, plane)
    ids = np.where(np.isinf(depth), 0, np.where(ball < plane, 1, 2))
    # The sphere's polygons have another silhouette: pixels whose ray passes within 1 % of it are left out.
    sure = np.abs(discriminant / (a * (to_ball @ to_ball))) > 0.005
    assert sure.mean() > 0.9 and (ids == 1).sum() > 300 and (ids == 0).any()
    assert (out["instance"] == ids)[sure].all() and out["instance"].dtype == np.uint32
    assert (out["semantic"] == np.array([0, 7, 1])[out["instance"]]).all()
    flat = sure & (ids == 2)
    assert np.abs(out["depth"] / depth - 1)[flat].max() < 1e-4
    round_ = sure & (ids == 1)
    # The polygons of 256 rings are at most 1 - cos(pi / 512) = 2e-5 m below the sphere.
    assert np.abs(out["depth"] / depth - 1)[round_].max() < 1e-4
    position = eye + depth[..., None] * direction
    assert np.abs(out["position"] - position)[flat].max() < 1e-3
    assert np.allclose(out["distance"], out["depth"] * np.sqrt(a), rtol=1e-5)
    normal = np.where((ids == 1)[..., None], position - (0, 1, 0), (0, 1, 0))
    cosine = (out["normal"] * normal / np.linalg.norm(normal, axis=-1, keepdims=True)).sum(-1)[sure & (ids > 0)]
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 0.5
    assert np.allclose(out["albedo"][out["instance"] == 2], (0.2, 0.4, 0.6), atol=1e-4)
    nothing = out["instance"] == 0
    assert all((out[name][nothing] == 0).all() for name in SURFACES)
    assert (out["material"][out["instance"] == 2] == 2).all() and ball_and_plane.material_names[2] == "paint"


@pytest.mark.parametrize("seed", range(6))
def test_masks_are_those_of_the_path_tracer(seed):
    random = np.random.default_rng(seed)
    scene, card = lf.Scene(), quad()
    for index in range(8):
        turn, _ = np.linalg.qr(random.normal(size=(3, 3)))
        pose = at(*random.uniform(-1, 1, 3))
        pose[:3, :3] = turn * np.sign(np.linalg.det(turn)) * random.uniform(0.2, 0.6)
        scene.add(card, pose=pose, name=f"card {index}")
    camera = lf.Camera.look_at((0, 0.5, 4), (0, 0, 0))
    traced = lf.reference(scene, camera, SIZE, spp=1)
    with lf.Renderer(scene, indirect="none") as renderer:
        drawn = renderer.render(camera, SIZE, ("instance", "distance"))
    differs = traced["instance"] != drawn["instance"]
    # A centre on an edge, within the rasteriser's grid of 1/256 pixel, may be either side.
    assert differs.sum() <= 2, differs.sum()
    same = ~differs & (drawn["instance"] > 0)
    assert np.abs(traced["distance"] / np.maximum(drawn["distance"], 1e-9) - 1)[same].max() < 1e-4


PROGRAM = os.environ.get("LANTERNFISH_PROGRAM")


@pytest.mark.skipif(not PROGRAM, reason="LANTERNFISH_PROGRAM names no program")
@pytest.mark.parametrize("name, flags, settings", [
    ("demo:cornell", [], {}),
    ("demo:furnace", ["--background=transparent", "--accumulate=2"], {"background": "transparent", "accumulate": 2}),
])
def test_bytes_are_those_of_the_command_line(tmp_path, name, flags, settings):
    color, surfaces = "rgba" if settings else "rgb", ("depth", "normal", "instance")
    common = [PROGRAM, "render", name, "--quality=draft", "--size=96x64", "--quiet", "--outputs", ",".join(surfaces)]
    for path in ("image.npz", "image.png"):
        subprocess.run([*common, *flags, "-o", tmp_path / path], check=True, stdout=subprocess.DEVNULL)
    with lf.Renderer(lf.load(name), quality="draft", **settings) as renderer:
        out = renderer.render(size=SIZE, outputs=(color, "radiance", *surfaces))
    written = np.load(tmp_path / "image.npz")
    assert (written["image"] == out["radiance"]).all()
    assert all((written[output] == out[output]).all() for output in surfaces)
    assert (np.asarray(pytest.importorskip("PIL.Image").open(tmp_path / "image.png")) == out[color]).all()


def test_an_image_repeats_and_a_batch_has_the_images_of_its_cameras(ball_and_plane):
    cameras = [lf.Camera.look_at((4 * np.sin(a), 2, 4 * np.cos(a)), (0, 1, 0)) for a in (0, 1, 2)]
    calls = []
    with lf.Renderer(ball_and_plane, "draft", exposure=0) as renderer:
        batch = renderer.render(cameras, SIZE, ("rgb", "depth"), progress=lambda *counts: calls.append(counts))
        single = renderer.render(cameras[1], SIZE, ("rgb", "depth"))
    assert [array.shape for array in (batch["rgb"], single["depth"])] == [(3, 64, 96, 3), (64, 96)]
    assert (batch["rgb"][1] == single["rgb"]).all() and (batch["depth"][1] == single["depth"]).all()
    assert calls == [(1, 3), (2, 3), (3, 3)] and single._repr_png_().startswith(b"\x89PNG")


def test_conventions_of_calibrated_cameras_agree():
    opengl = lf.Camera.look_at((1, 2, 3), (0, 0, 0))
    opencv = opengl.pose @ np.diag([1, -1, -1, 1.0])
    k = opengl.intrinsics(SIZE)
    calibrated = lf.Camera.from_intrinsics(k[0, 0], k[1, 1], k[0, 2], k[1, 2], SIZE, opencv, near=0.1)
    assert np.allclose(calibrated.pose, opengl.pose) and np.allclose(calibrated.intrinsics(), k)
    scene = lf.Scene()
    scene.add(sphere(), name="ball")
    scene.add(lf.PointLight((2, 3, 4), 50))
    with lf.Renderer(scene, indirect="none") as renderer:
        a, b = (renderer.render(camera, SIZE, "depth")["depth"] for camera in (opengl, calibrated))
    assert np.allclose(a, b, rtol=1e-5) and (a > 0).any()
    # The ball's centre is where the matrices say.
    rows, columns = np.nonzero(b)
    p = k @ (np.linalg.inv(opencv) @ (0, 0, 0, 1))[:3]
    assert abs(columns.mean() + 0.5 - p[0] / p[2]) < 0.2 and abs(rows.mean() + 0.5 - p[1] / p[2]) < 0.2


def test_textures_colours_and_materials_reach_the_albedo():
    pixels = np.zeros((2, 2, 3), np.uint8)
    pixels[0, 0], pixels[0, 1], pixels[1, 0], pixels[1, 1] = (255, 0, 0), (0, 255, 0), (0, 0, 255), (255, 255, 255)
    scene = lf.Scene()
    level = np.full((4, 4, 3), (128, 128, 255), np.uint8)
    textured = lf.Material(base_color_texture=np.repeat(np.repeat(pixels, 8, 0), 8, 1), normal_texture=level)
    scene.add(quad(textured), pose=at(-1.2, 0, 0))
    colored = lf.Mesh([(0, -1, 0), (2, -1, 0), (0, 1, 0)], [(0, 1, 2)], colors=np.full((3, 3), 188, np.uint8))
    scene.add(colored)
    camera = lf.Camera.look_at((0, 0, 5), (0, 0, 0))
    with lf.Renderer(scene, indirect="none") as renderer:
        albedo = renderer.render(camera, SIZE, "albedo")["albedo"]
        expected = [(-1.7, 0.5, (1, 0, 0)), (-0.7, 0.5, (0, 1, 0)), (-1.7, -0.5, (0, 0, 1)), (0.4, -0.4, (0.5,) * 3)]
        for x, y, color in expected:
            x, y, _ = camera.intrinsics(SIZE) @ (x, -y, 5) / 5
            assert np.allclose(albedo[int(y), int(x)], color, atol=0.01), (color, albedo[int(y), int(x)])
        renderer.set_material(2, base_color=(1, 0, 0))
        assert np.allclose(renderer.render(camera, SIZE, "albedo")["albedo"][int(y), int(x)], (0.5, 0, 0), atol=0.01)
