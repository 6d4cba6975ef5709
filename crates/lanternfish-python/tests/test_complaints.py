"""Complaints about other renderers, from their trackers: a test each, or covered elsewhere, or not applicable:

- no driver (mmatl/pyrender#92): test_without_an_adapter_the_remedy_is_named_and_the_environment_kept
- threads (mmatl/pyrender#200, isl-org/Open3D#6628, isl-org/Open3D#6968, mitsuba-renderer/mitsuba2#525):
  test_threads_share_a_renderer_and_have_their_own, test_a_forked_process_is_refused_and_ends_and_a_spawned_one_works
- depth of parallel rays (mmatl/pyrender#19, mmatl/pyrender#254): test_intrinsics_and_parallel_rays
- RGBA of three channels (mmatl/pyrender#137, mmatl/pyrender#209): test_colour_depth_masks_and_flags
- poses and K (mmatl/pyrender#123, mitsuba-renderer/mitsuba3#1124): test_conventions_of_calibrated_cameras_agree
- memory of renderers (isl-org/Open3D#3042, isl-org/Open3D#4480): test_renderers_leave_no_memory_behind
- alpha of 255 everywhere (isl-org/Open3D#6738): test_a_sky_lights_behind_a_transparent_background
- one incomplete mask in thousands (DLR-RM/BlenderProc#415): test_masks_are_those_of_the_path_tracer
- wireframes show hidden faces (mmatl/pyrender#55): wireframes are refused.
- temporary images fill the disk (DLR-RM/BlenderProc#286): no image goes through a file.
"""

import os
import subprocess
import sys

import numpy as np
import pytest
from conftest import at, ball, quad, rays

import lanternfish as lf
import lanternfish.pyrender as pyrender

SIZE = (64, 48)
CAMERA = lf.Camera.look_at((0, 0, 5), (0, 0, 0))
FAST = {"quality": "draft", "indirect": "none", "light_rig": "none", "exposure": 0, "tone_map": "none"}
UNLIT = lf.Material(unlit=True)
VERTICES = "\n".join(f"v {x} {y} 0 1 0 0" for y in (-1, 1) for x in (-1, 0, 1)) + "\n"


def scene_of(*parts) -> lf.Scene:
    scene = lf.Scene()
    for mesh, pose in parts:
        scene.add(mesh, pose=pose)
    return scene


def image(scene, outputs, camera=CAMERA, size=SIZE, **settings) -> lf.Images:
    with lf.Renderer(scene, **{**FAST, **settings}) as renderer:
        return renderer.render(camera, size, outputs)


def turned(degrees: float, x=0.0, y=0.0, z=0.0) -> np.ndarray:
    angle, pose = np.radians(degrees), at(x, y, z)
    pose[:2, :2] = (np.cos(angle), -np.sin(angle)), (np.sin(angle), np.cos(angle))
    return pose


def test_no_display_is_needed_imports_are_fast_and_a_process_ends_without_close():
    """Import or EGL fails without a display, or the process hangs at its end: mmatl/pyrender#7, mmatl/pyrender#32,
    mmatl/pyrender#146, isl-org/Open3D#4011, isl-org/Open3D#5292, isl-org/Open3D#2984."""
    code = """import time, numpy
started = time.time()
import lanternfish as lf
print(time.time() - started < 1)
import lanternfish.pyrender
print([name for name in ("libEGL", "libGL", "libX11") if name in open("/proc/self/maps").read()])
print((kept := lf.Renderer(lf.load("demo:furnace"))).render(size=(16, 16), outputs="depth")["depth"].max() > 0)"""
    hidden = {name: value for name, value in os.environ.items() if "DISPLAY" not in name and name != "XDG_RUNTIME_DIR"}
    run = subprocess.run([sys.executable, "-c", code], env=hidden, capture_output=True, text=True, timeout=60)
    assert run.stdout == "True\n[]\nTrue\n" and run.returncode == 0, run


def test_renderers_of_any_size_come_and_go_and_fill_their_images():
    """A second renderer, or one after another's end, fails, or depth fills a quarter of the image: mmatl/pyrender#148,
    mmatl/pyrender#223, isl-org/Open3D#7132, isl-org/Open3D#4978, isl-org/Open3D#5980, isl-org/Open3D#6270."""
    scene, outputs = scene_of((quad(UNLIT), np.diag((1000.0, 1000, 1, 1)))), ("rgb", "depth")
    with lf.Renderer(scene, **FAST) as kept:
        for size in (SIZE, (61, 47), (1, 1), (130, 3)):
            for out in (image(scene, outputs, size=size), kept.render(CAMERA, size, outputs)):
                assert out["depth"].shape == size[::-1] and np.allclose(out["depth"], 5) and (out["rgb"] == 255).all()


def test_many_meshes_textures_and_frames_leave_no_memory_behind():
    """Memory grows with scenes that are made in a loop, or images become blank after many: isl-org/Open3D#5352,
    isl-org/Open3D#6912, mitsuba-renderer/mitsuba3#954, DLR-RM/BlenderProc#400, DLR-RM/BlenderProc#1194."""
    resident = []
    with lf.Renderer(lf.load("demo:furnace"), **FAST) as renderer:
        for index in range(60):
            resident.append(int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGE_SIZE"))
            skin = lf.Material(base_color_texture=np.full((256, 256, 3), index, np.uint8))
            renderer.update(lf.load("demo:furnace"))
            renderer.update(scene_of((ball(10 + index / 100, 48, skin), None)))
            for step in range(5):
                renderer.set_pose(1, at(0, 0, -10 - step))
                depth = renderer.render(CAMERA, (16, 16), "depth")["depth"]
                assert abs(depth[8, 8] - 5 - step + index / 100) < 0.1
    # Up to 18 MiB come and go; scenes that stay would be 35 MiB.
    assert min(resident[45:]) - min(resident[5:20]) < 12 << 20


def test_depth_is_precise_near_and_far():
    """Depth has few steps, rings, another unit than m, or a far plane that cuts: mmatl/pyrender#17,
    mitsuba-renderer/mitsuba2#460, isl-org/Open3D#4035, isl-org/Open3D#4519, DLR-RM/BlenderProc#1106."""
    floor = np.array([(1e5, 0, 0, 0), (0, 0, 1e5, 0), (0, -1e5, 0, 0), (0, 0, 0, 1)])
    camera = lf.Camera(at(0, 10, 0), fov_y=2, near=1e-3)
    depth, slope = image(scene_of((quad(), floor)), "depth", camera)["depth"], -rays(camera, SIZE)[1][..., 1]
    assert (depth[:24] == 0).all() and np.abs(depth[24:] * slope[24:] / 10 - 1).max() < 1e-4 and depth.max() > 2e4
    card = at(0, 0, -1e6) @ np.diag((1e5, 1e5, 1, 1))
    assert np.allclose(image(scene_of((quad(), card)), "depth", camera)["depth"], 1e6, rtol=1e-5)


def test_far_from_the_origin_surfaces_are_those_of_32_bit_numbers():
    """Objects at a map's coordinates vanish and tremble: RobotLocomotion/drake#2244."""
    near, far = (image(scene_of((ball(1, 64), at(*p))), ("depth", "instance"), CAMERA.moved(at(*p[:2], p[2] + 5)))
                 for p in ((0, 0, 0), (759186, 50, -2957195)))
    same = near["instance"] == far["instance"]
    assert same.mean() > 0.99 and np.abs(far["depth"] - near["depth"])[same].max() <= np.spacing(np.float32(3e6))


def test_edges_are_no_mix_of_surfaces_and_have_no_outline_over_another_image():
    """Depth and masks at edges are means of two surfaces, or colours are dark: mitsuba-renderer/mitsuba3#396,
    mitsuba-renderer/mitsuba3#575, mitsuba-renderer/mitsuba3#1059, DLR-RM/BlenderProc#56, mmatl/pyrender#101."""
    scene = scene_of((quad(UNLIT), turned(20)), (quad(UNLIT), turned(50, 1, 0, -3)))
    out = image(scene, ("rgba", "depth", "instance"), accumulate=8, background="transparent")
    alpha, depth = out["rgba"][..., 3:] / 255, np.array([0, 5, 8])[out["instance"]]
    assert set(out["instance"].flat) == {0, 1, 2} and np.allclose(out["depth"], depth, atol=0)
    assert ((alpha > 0.1) & (alpha < 0.9)).sum() > 20
    assert np.abs(out["rgba"][..., :3] * alpha + 255 * (1 - alpha) - 255).max() <= 1


def test_masks_and_flat_colours_are_those_that_were_given():
    """Masks mix colours where meshes cross, and flat colours are smoothed at edges, too bright or too dim:
    mmatl/pyrender#269, mmatl/pyrender#51, mmatl/pyrender#238."""
    trimesh = pytest.importorskip("trimesh")
    scene, nodes, colors = pyrender.Scene(bg_color=(0, 0, 0, 0)), {}, ((0, 200, 0), (200, 64, 1))
    for color, pose in zip(colors, (turned(20), turned(50, 0.2, 0, 0.1))):
        box = trimesh.creation.box((1, 1, 1))
        box.visual.face_colors = color
        nodes[scene.add(pyrender.Mesh.from_trimesh(box, smooth=False), pose=pose)] = color
    scene.add(pyrender.PerspectiveCamera(np.pi / 6), pose=at(0.5, 0.8, 4))
    renderer, flags = pyrender.OffscreenRenderer(*SIZE), pyrender.RenderFlags
    mask, flat = (renderer.render(scene, flag, nodes)[0] for flag in (flags.SEG, flags.FLAT))
    assert (mask == flat).all() and set(map(tuple, mask.reshape(-1, 3).tolist())) == {(0, 0, 0), *colors}


def test_positions_project_to_the_centres_of_their_pixels():
    """The principal point is ignored, off by a half or wrong for oblong images: mmatl/pyrender#54,
    DLR-RM/BlenderProc#385, DLR-RM/BlenderProc#1235, isl-org/Open3D#5049, mitsuba-renderer/mitsuba2#570."""
    pose = lf.Camera.look_at((1, 2, 4), (0, 0, 0)).pose
    camera = pyrender.IntrinsicsCamera(70, 55, 40.3, 17.8).make(pose, SIZE)
    out = image(scene_of((ball(1.5, 64), None)), ("position", "instance"), camera)
    rows, columns = np.nonzero(out["instance"])
    x, y, z = ((out["position"][rows, columns] - pose[:3, 3]) @ pose[:3, :3]).T
    assert len(rows) > 300 and np.abs(40.3 - 70 * x / z - columns - 0.5).max() < 0.01
    assert np.abs(17.8 + 55 * y / z - rows - 0.5).max() < 0.01


@pytest.mark.parametrize("level", [0, 1, 64, 128, 200, 254, 255])
def test_colours_without_light_and_of_backgrounds_are_exact(level):
    """White is grey, black has noise, base colours are tone mapped: isl-org/Open3D#3214, isl-org/Open3D#4108,
    isl-org/Open3D#6020, isl-org/Open3D#5215, isl-org/Open3D#5760."""
    card = lf.Mesh(quad().vertices, quad().faces, colors=np.full((4, 3), level, np.uint8), material=UNLIT)
    behind = (255 - level, level, 0)
    out = image(scene_of((card, None)), ("rgb", "instance"), background="#" + bytes(behind).hex())
    assert (out["rgb"] == np.where(out["instance"][..., None] > 0, level, behind)).all() and out["instance"].any()


def test_normals_are_of_the_world_and_at_right_angles_to_faces():
    """Normals are smooth where faces are flat, of the camera's space, or slanted: mmatl/pyrender#39,
    DLR-RM/BlenderProc#747, DLR-RM/BlenderProc#900, DLR-RM/BlenderProc#949."""
    scene = lf.Scene.from_trimesh(pytest.importorskip("trimesh").creation.box((1, 1, 1)), smooth=False)
    pose = np.diag((1, 2, 0.5, 1)) @ turned(30) @ lf.Camera.look_at((0, 0, 0), (1, 2, 3)).pose
    scene.set_pose(1, pose)
    axes = np.linalg.inv(pose[:3, :3])
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    for eye in ((0, 0, 5), (3, 3, -3), (-1, -4, 0.5)):
        out = image(scene, ("normal", "position", "instance"), lf.Camera.look_at(eye, (0, 0, 0)))
        normal, position = (out[name][out["instance"] > 0] for name in ("normal", "position"))
        assert len(normal) > 100 and np.abs(np.abs(normal @ axes.T).max(axis=1) - 1).max() < 1e-3
        assert (((eye - position) * normal).sum(axis=1) > 0).all()


@pytest.mark.parametrize("expected, alpha, mode", [
    (2, 0.4, "mask"), (1, 0.6, "mask"), (2, 0.4, "blend"), (1, 0.6, "blend"), (1, 0.4, "opaque"), (1, None, "glass")])
def test_depth_and_masks_have_holes_and_glass(expected, alpha, mode):
    """A leaf's mask is its card, or depth of glass is from behind it (here an opacity of a half counts):
    mmatl/pyrender#242, DLR-RM/BlenderProc#244, DLR-RM/BlenderProc#68, DLR-RM/BlenderProc#789."""
    leaf = np.full((16, 16, 4), 255 * (alpha or 1), np.uint8)
    material = lf.Material(base_color_texture=leaf, alpha_mode=mode) if alpha else lf.Material(transmission=1)
    out = image(scene_of((quad(material), None), (quad(), at(0, 0, -1))), ("depth", "instance"))
    assert out["instance"][24, 32] == expected and abs(out["depth"][24, 32] - 4 - expected) < 1e-4


def test_an_obj_file_has_all_its_materials_and_upright_textures(tmp_path):
    """Of an OBJ file, textures, materials or square faces are missing, or rows of odd widths are slanted:
    isl-org/Open3D#2510, isl-org/Open3D#2688, isl-org/Open3D#3037, mmatl/pyrender#265."""
    for name, color in (("a", (255, 0, 0)), ("b", (0, 0, 255))):
        pixels = np.full((20, 21, 3), color, np.uint8)
        pixels[:10, :7] = 0, 255, 0
        lf.write_png(tmp_path / f"{name}.png", pixels)
    (tmp_path / "two.mtl").write_text("newmtl a\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\n")
    faces = "usemtl a\nf 1/1 2/2 5/3 4/4\nusemtl b\nf 2/1 3/2 6/3 5/4\n"
    (tmp_path / "two.obj").write_text("mtllib two.mtl\n" + VERTICES + "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n" + faces)
    albedo = image(lf.load(tmp_path / "two.obj"), "albedo", size=(96, 96))["albedo"]
    for x, y, color in ((30, 40, (0, 1, 0)), (42, 40, (1, 0, 0)), (30, 56, (1, 0, 0)), (66, 40, (0, 0, 1))):
        assert np.allclose(albedo[y, x], color, atol=0.01), (x, y, albedo[y, x])


@pytest.mark.parametrize("by", ["trimesh", "file"])
def test_an_obj_file_has_the_colours_of_its_vertices(tmp_path, by):
    """Colours of an OBJ file's vertices are not shown: mmatl/pyrender#33."""
    path, trimesh = tmp_path / "red.obj", pytest.importorskip("trimesh")
    path.write_text(VERTICES + "f 1 3 4\n")
    scene = lf.load(path) if by == "file" else lf.Scene.from_trimesh(trimesh.load(path))
    assert np.allclose(image(scene, "albedo")["albedo"][28, 30], (1, 0, 0), atol=0.01)


def test_light_has_its_unit_and_both_sides_of_a_surface_receive_it():
    """Models are black as intensity has no unit, back faces are dark, faces that are there twice make a chequer:
    mmatl/pyrender#42, mmatl/pyrender#76, mmatl/pyrender#122, mmatl/pyrender#202, facebookresearch/pytorch3d#504."""
    card = quad(lf.Material((0.5, 0.5, 0.5), roughness=1, ior=1))
    twice = lf.Mesh(card.vertices, np.concatenate([card.faces, card.faces[:, ::-1]]), material=card.material)
    for light, lux in ((lf.PointLight((0, 0, 4), 100), 100 / 16), (lf.DirectionalLight((0, 0, -1), 3), 3)):
        for mesh, pose in ((card, None), (card, np.diag((-1.0, 1, -1, 1))), (twice, None)):
            scene = scene_of((mesh, pose))
            scene.add(light)
            assert np.allclose(image(scene, "radiance")["radiance"][20:28, 28:36], lux * 0.5 / np.pi, rtol=0.04)


def test_a_sky_lights_behind_a_transparent_background():
    """An environment makes alpha 1, or a transparent background changes depth: mitsuba-renderer/mitsuba3#462,
    mitsuba-renderer/mitsuba2#529, DLR-RM/BlenderProc#423."""
    scene = scene_of((ball(1, 24), None))
    scene.set_sky(0.5)
    images = [image(scene, ("rgba", "depth"), indirect="sampled", background=b) for b in ("transparent", "environment")]
    hidden, seen = (out["rgba"] for out in images)
    assert (hidden[0] == 0).all() and (seen[0, :, 3] == 255).all() and seen[0].min() > 180
    assert (hidden[24, 32] == seen[24, 32]).all() and seen[24, 32].min() > 150
    assert (images[0]["depth"] == images[1]["depth"]).all() and (images[0]["depth"][0] == 0).all()
