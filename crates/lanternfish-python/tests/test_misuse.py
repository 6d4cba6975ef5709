"""Mistakes are exceptions that say what was meant; nothing is printed, and the interpreter lives."""

import os
import subprocess
import sys
import types

import numpy as np
import pytest
from conftest import at, quad

import lanternfish as lf
from lanternfish import _driver

P, F = [(0, 0, 0), (1, 0, 0), (0, 1, 0)], [(0, 1, 2)]
CAMERA = lf.Camera.look_at((0, 0, 5), (0, 0, 0))


@pytest.mark.parametrize("make, words", [
    (lambda: lf.Mesh(np.zeros((3, 2)), F), "vertices: an array of any x 3"),
    (lambda: lf.Mesh("abc", F), "vertices: numbers are meant"),
    (lambda: lf.Mesh(P, [(0, 1, 3)]), "vertex 3 of 3"),
    (lambda: lf.Mesh(P, [(0, 1, -1)]), "faces: numbers from 0"),
    (lambda: lf.Mesh(P, [(0, 1, 1.5)]), "whole numbers"),
    (lambda: lf.Mesh(np.full((3, 3), np.nan), F), "not finite"),
    (lambda: lf.Mesh(np.full((3, 3), 1e300), F), "not finite"),
    (lambda: lf.Mesh(np.zeros((0, 3)), np.zeros((0, 3), int)), "at least one triangle"),
    (lambda: lf.Mesh(P, F, normals=[(0, 0, 1)]), "normals: an array of 3 x 3"),
    (lambda: lf.Mesh(P, F, material="red"), "a Material is meant"),
    (lambda: lf.Material(base_color=(1, 2)), "base_color"),
    (lambda: lf.Material(base_color_texture=np.zeros((2, 2, 3))), "8-bit"),
    (lambda: lf.Camera(np.eye(3)), "4 x 4"),
    (lambda: lf.Camera(at(1, 2, 3).T), "transposed"),
    (lambda: lf.Camera(fov_y=180), "degrees"),
    (lambda: lf.Camera(convention="blender"), "opengl or opencv"),
    (lambda: lf.Camera.look_at((1, 1, 1), (1, 1, 1)), "differ"),
    (lambda: lf.Camera.from_intrinsics(0, 1, 2, 3, (4, 4)), "focal lengths"),
    (lambda: lf.Scene().add(lf.PointLight((0, 0), 1)), "position"),
    (lambda: lf.Scene().add(lf.PointLight((0, 0, 0), -1)), "0 or more"),
    (lambda: lf.Scene().add(lf.DirectionalLight((0, 0, 0))), "direction"),
    (lambda: lf.Scene().add(lf.Camera(), pose=np.eye(4)), "its own place"),
    (lambda: lf.Scene().add(3), "a Mesh, a light or a Camera"),
    (lambda: lf.Scene().pose("cup"), "no instance called 'cup'"),
    (lambda: lf.Scene().pose(0), "numbered from 1"),
    (lambda: lf.Scene.from_trimesh(3), "trimesh"),
    (lambda: lf.load("demo:cornell", up="x"), "up: expected"),
    (lambda: lf.Renderer(lf.Scene(), quality="fast"), "quality: expected"),
    (lambda: lf.Renderer(lf.Scene(), acumulate=3), "did you mean \"accumulate\""),
    (lambda: lf.Renderer(lf.Scene(), accumulate="many"), "accumulate: expected"),
    (lambda: lf.Renderer(lf.Scene(), light_rig="moon"), "light_rig: expected"),
    (lambda: lf.reference(lf.Scene(), CAMERA, (4, 4), spp=0), "at least 1 sample"),
    (lambda: lf.compare(np.zeros((4, 4, 3)), np.zeros((4, 5, 3))), "cannot be compared"),
    (lambda: lf.compare(np.zeros((4, 4, 3)), np.zeros((4, 4, 3), np.uint8)), "both"),
    (lambda: lf.png(np.zeros((4, 4))), "8- or 16-bit"),
])
def test_mistakes_are_value_errors(make, words):
    with pytest.raises(ValueError) as caught:
        make()
    assert words in str(caught.value)


def test_mistakes_of_rendering_leave_the_renderer_usable():
    scene = lf.Scene()
    scene.add(quad(), name="card")
    renderer = lf.Renderer(scene, indirect="none")
    scaled = lf.Camera(2 * CAMERA.pose + np.diag([0, 0, 0, -1]))
    for call, words in [
        (lambda: renderer.render(scaled), "scales"),
        (lambda: renderer.render([]), "not none"),
        (lambda: renderer.render([3]), "not int"),
        (lambda: renderer.render(CAMERA, (0, 4)), "above 0"),
        (lambda: renderer.render(CAMERA, (10**6, 4)), "each side must be"),
        (lambda: renderer.render(CAMERA, (8, 8), ("depht",)), 'did you mean "depth"'),
        (lambda: renderer.set_pose("cup", np.eye(4)), "no instance called"),
        (lambda: renderer.set_pose("card", np.full((4, 4), np.nan)), "not finite"),
        (lambda: renderer.set_light(9, lf.PointLight((0, 0, 0))), "no light 9"),
        (lambda: renderer.set_material(1, colour=1), "'colour'"),
        (lambda: setattr(renderer, "exposure", "bright"), "exposure: expected"),
    ]:
        with pytest.raises(ValueError) as caught:
            pytest.fail(f"{call()} instead of {words}")
        assert words in str(caught.value), caught.value
    with pytest.raises(lf.Error, match="animation"):
        renderer.set_time(1)
    with pytest.raises(lf.Error, match="within its own progress"):
        renderer.render(CAMERA, (8, 8), progress=lambda done, count: renderer.render(CAMERA, (8, 8)))
    with pytest.raises(ZeroDivisionError):
        renderer.render(CAMERA, (8, 8), progress=lambda done, count: 1 / 0)
    assert (renderer.render(CAMERA, (8, 8), "instance")["instance"] == 1).any()
    renderer.close()
    renderer.close()
    with pytest.raises(lf.Error, match="closed"):
        renderer.render(CAMERA, (8, 8))


def test_empty_scenes_are_images_of_nothing():
    with lf.Renderer(lf.Scene(), indirect="none") as renderer:
        out = renderer.render(size=(8, 8), outputs=("rgb", "depth", "instance"))
    assert all((array == 0).all() for array in out.values())


def test_missing_and_broken_files_are_told(tmp_path):
    with pytest.raises(FileNotFoundError, match="none.glb"):
        lf.load(tmp_path / "none.glb")
    (tmp_path / "broken.glb").write_bytes(b"glTF" + bytes(20))
    with pytest.raises(lf.Error, match="broken.glb"):
        lf.load(tmp_path / "broken.glb")
    with pytest.raises(lf.Error, match="did you mean|there are"):
        lf.load("demo:castle")
    with pytest.raises(lf.Error, match="no adapter called"):
        lf.Renderer(lf.Scene(), adapter="none of this name")


DRIVER = """
import os, sys
sys.modules["lanternfish_lavapipe"] = None
os.environ["VK_DRIVER_FILES"] = "/none.json"
os.environ["HOME"] = "/none"
import lanternfish as lf
from lanternfish import _driver
print(sorted(_driver._shader_cache()))
before = dict(os.environ)
try:
    lf.Renderer(lf.Scene())
except lf.NoAdapter as error:
    print("pip install lanternfish-lavapipe" in str(error), dict(os.environ) == before)
"""


def test_without_an_adapter_the_remedy_is_named_and_the_environment_kept():
    run = subprocess.run([sys.executable, "-c", DRIVER], capture_output=True, text=True, timeout=60)
    caches = [] if os.access("/", os.W_OK) else ["MESA_SHADER_CACHE_DIR"]
    assert run.stdout == f"{caches}\nTrue True\n" and run.stderr == "", run


def test_the_driver_of_the_package_is_used_where_there_is_no_other(monkeypatch):
    opened, loaded = [], []

    def device(adapter):
        opened.append((adapter, os.environ.get("VK_ADD_DRIVER_FILES")))
        if opened[-1][1] is None:
            raise lf.NoAdapter("none")
        return "device"

    package = types.SimpleNamespace(icd=lambda: "/icd.json", loader=lambda: "/libvulkan.so.1")
    monkeypatch.setitem(sys.modules, "lanternfish_lavapipe", package)
    monkeypatch.setattr(_driver, "_lanternfish", types.SimpleNamespace(Device=device, NoAdapter=lf.NoAdapter))
    monkeypatch.setattr(_driver.ctypes, "CDLL", lambda path, mode: loaded.append(path))
    before = dict(os.environ)
    assert _driver._open("cpu") == "device" and os.environ == before
    assert opened == [("cpu", None), ("cpu", "/icd.json")] and loaded == ["/libvulkan.so.1"]
