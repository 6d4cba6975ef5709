"""Changes between images, and how a renderer behaves as an object of Python."""

import gc
import logging
import os
import subprocess
import sys
import threading

import numpy as np
import pytest
from conftest import SIZE, at, quad, sphere

import lanternfish as lf

CAMERA = lf.Camera.look_at((0, 0, 5), (0, 0, 0))


def two_cards() -> lf.Scene:
    scene, card = lf.Scene(), quad()
    for index, x in enumerate((-1.2, 1.2)):
        assert scene.add(card, pose=at(x, 0, 0), name=("left", "right")[index], semantic=index) == index + 1
    scene.add(lf.PointLight((0, 0, 3), 30, name="lamp"))
    return scene


def test_moves_are_sent_alone_and_are_those_of_a_new_scene():
    scene = two_cards()
    with lf.Renderer(scene, "draft", exposure=0) as renderer:
        before = renderer.render(CAMERA, SIZE, ("rgb", "instance"))
        there = renderer.moment(CAMERA)
        renderer.set_poses({"left": at(-1.2, 0.4, 0), 2: at(1.2, -0.4, -1)})
        after = renderer.render(CAMERA, SIZE, ("rgb", "instance", "depth", "motion"), towards=there)
        assert 0 < renderer.sent_bytes < 4096 and (after["rgb"] != before["rgb"]).any()
    for name, pose in (("left", at(-1.2, 0.4, 0)), ("right", at(1.2, -0.4, -1))):
        scene.set_pose(name, pose)
    assert np.allclose(scene.pose("right"), at(1.2, -0.4, -1))
    with lf.Renderer(scene, "draft", exposure=0) as renderer:
        new = renderer.render(CAMERA, SIZE, ("rgb", "instance", "depth"))
    assert all((new[name] == after[name]).all() for name in ("instance", "depth"))
    assert np.abs(new["rgb"].astype(int) - after["rgb"]).mean() < 0.5
    # It was 0.4 m lower on the left: pixels down at the middle, by the focal length over 5 m.
    motion = after["motion"][after["instance"] == 1]
    assert np.allclose(motion, (0, 0.4 / 5 * CAMERA.intrinsics(SIZE)[1, 1]), atol=0.1)


def test_lights_and_exposure_change():
    with lf.Renderer(two_cards(), "draft") as renderer:
        assert renderer.exposure is None
        first = renderer.render(CAMERA, SIZE, ("rgb", "radiance"))
        metered = renderer.exposure
        renderer.set_light("lamp", lf.PointLight((0, 0, 3), 60, name="lamp"))
        brighter = renderer.render(CAMERA, SIZE, ("rgb", "radiance"))
        assert renderer.exposure == metered and brighter["rgb"].mean() > first["rgb"].mean() + 5
        assert abs(brighter["radiance"].sum() / first["radiance"].sum() - 2) < 0.02
        renderer.exposure = "auto"
        renderer.render(CAMERA, SIZE)
        assert abs(renderer.exposure - metered + 1) < 0.2
        red = lf.SpotLight((0, 0, 3), (0, 0, -1), 30, color=(1, 0, 0))
        renderer.set_lights([red, lf.DiskLight((2, 0, 2), (-1, 0, -1))])
        red, green, _ = renderer.render(CAMERA, SIZE, "radiance")["radiance"].mean((0, 1))
        assert red > 1.2 * green > 0


def test_a_scene_without_light_gets_a_rig_and_a_note(caplog):
    scene = lf.Scene()
    scene.add(sphere())
    with caplog.at_level(logging.INFO, "lanternfish"), lf.Renderer(scene, "draft") as renderer:
        image = renderer.render(size=SIZE)["rgb"]
        assert renderer.exposure == 0 and image.std() > 20
    assert any("light rig studio" in record.message for record in caplog.records), caplog.text
    with lf.Renderer(scene, "draft", light_rig="none", exposure=0) as renderer:
        assert (renderer.render(size=SIZE)["rgb"] == 0).all()


def test_a_file_keeps_names_classes_cameras_and_animations():
    scene = lf.load("demo:cornell")
    assert set(scene.names) == set(range(1, len(scene.names) + 1)) and scene.classes[1] == 0
    scene.set_class(1, 5)
    assert scene.classes[1] == 5 and scene.cameras and scene.bounds.shape == (2, 3) and scene.animations == []
    assert scene.cameras[0].moved(at(0, 1, 2)).pose[2, 3] == 2
    assert lf.Scene().bounds is None and len(scene.lights) == len(lf.load("demo:cornell").lights)


def test_lights_and_cameras_come_back_as_they_were_added():
    scene, eye, down = lf.Scene(), (1, 2, 3), (0, -1, 0)
    lights = [
        (lf.PointLight(eye, 5, range=4, name="lamp"), ["position"]),
        (lf.SpotLight(eye, down, 7, 10, 30, (1, 0.5, 0)), ["position", "direction", "angles"]),
        (lf.DirectionalLight(down, 9), ["direction"]),
        (lf.DiskLight(eye, down, 0.7), ["position", "direction", "size"]),
        (lf.RectangleLight(eye, down, (0, 0, 1), (2, 3)), ["position", "direction", "size", "right"]),
    ]
    assert [scene.add(light) for light, _ in lights] == [0, 1, 2, 3, 4]
    for (light, fields), back in zip(lights, scene.lights):
        assert (light.kind, light.name, light.range) == (back.kind, back.name, back.range)
        assert all(np.allclose(getattr(light, name), getattr(back, name)) for name in ["intensity", *fields]), back
    pose = lf.Camera.look_at(eye, (0, 0, 0)).pose
    cameras = [lf.Camera(pose, 37, 0.5), lf.Camera.from_intrinsics(90, 80, 30, 20, SIZE, pose, "opengl", 0.25)]
    for camera in (*cameras, lf.Camera.orthographic(pose, 2)):
        scene.add(camera, name="eye")
        back = scene.cameras[-1]
        assert (back.name, back.near) == ("eye", camera.near) and np.allclose(back.pose, pose)
    for camera, back in zip(cameras, scene.cameras):
        assert np.allclose(back.intrinsics(SIZE), camera.intrinsics(SIZE))


def test_scenes_of_trimesh_keep_places_colours_and_textures():
    trimesh = pytest.importorskip("trimesh")
    box = trimesh.creation.box((1, 1, 1))
    box.visual.face_colors = (255, 0, 0, 255)
    source = trimesh.Scene()
    source.add_geometry(box, node_name="box", transform=at(0, 0, -1))
    source.add_geometry(trimesh.creation.icosphere(), node_name="ball", transform=at(0, 0, -9))
    scene = lf.Scene.from_trimesh(source, smooth=False)
    box_id = {name: index for index, name in scene.names.items()}["box"]
    assert np.allclose(scene.pose("box"), at(0, 0, -1))
    with lf.Renderer(scene, indirect="none") as renderer:
        out = renderer.render(CAMERA, SIZE, ("albedo", "depth", "instance"))
    middle = tuple(side // 2 for side in SIZE[::-1])
    assert out["instance"][middle] == box_id and abs(out["depth"][middle] - 5.5) < 1e-3
    assert np.allclose(out["albedo"][middle], (1, 0, 0), atol=0.01)


def test_threads_share_a_renderer_and_have_their_own():
    scene, images, wrong = two_cards(), [None] * 4, []
    shared = lf.Renderer(scene, "draft", exposure=0)

    def work(index):
        try:
            renderer = shared if index < 2 else lf.Renderer(scene, "draft", exposure=0)
            images[index] = renderer.render(CAMERA, SIZE)["rgb"]
        except Exception as error:
            wrong.append(error)

    threads = [threading.Thread(target=work, args=(index,)) for index in range(4)]
    [thread.start() for thread in threads]
    [thread.join() for thread in threads]
    assert not wrong and all((image == images[0]).all() for image in images)
    shared.close()


def test_renderers_leave_no_memory_behind():
    def resident_after(count) -> int:
        for _ in range(count):
            lf.Renderer(scene, indirect="none").render(CAMERA, (16, 16))
        gc.collect()
        return int(open("/proc/self/statm").read().split()[1]) * os.sysconf("SC_PAGE_SIZE")

    scene = two_cards()
    before = resident_after(5)
    assert resident_after(40) - before < 40 << 20


def test_a_forked_process_is_refused_and_ends_and_a_spawned_one_works(tmp_path):
    code = """
import multiprocessing, os, sys, lanternfish as lf

def depth(queue):
    queue.put(lf.Renderer(lf.load("demo:cornell"), indirect="none").render(size=(16, 16), outputs="depth")["depth"].max())

if __name__ == "__main__":
    kept = lf.Renderer(lf.load("demo:cornell"), indirect="none")
    kept.render(size=(16, 16))
    if os.fork() == 0:
        try:
            kept.render(size=(16, 16))
        except lf.Error as error:
            print("spawn" in str(error), flush=True)
        del kept
        sys.exit(7)
    assert os.waitstatus_to_exitcode(os.wait()[1]) == 7
    context = multiprocessing.get_context("spawn")
    queue = context.Queue()
    process = context.Process(target=depth, args=(queue,))
    process.start()
    print(queue.get(timeout=60) > 5)
    process.join()
"""
    program = tmp_path / "program.py"
    program.write_text(code)
    run = subprocess.run([sys.executable, program], capture_output=True, text=True, timeout=120)
    assert run.stdout == "True\nTrue\n" and run.stderr == "", run


def test_signals_end_the_work_between_frames():
    code = """
import os, signal, threading, lanternfish as lf
# A shell without a terminal starts jobs that ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
scene = lf.load("demo:cornell")
renderer = lf.Renderer(scene, indirect="none", accumulate=100000)
threading.Timer(0.5, os.kill, (os.getpid(), signal.SIGINT)).start()
try:
    renderer.render(size=(64, 48))
except KeyboardInterrupt:
    print("interrupted", renderer.render(size=(64, 48), outputs="depth")["depth"].shape)
"""
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60)
    assert run.stdout == "interrupted (48, 64)\n" and run.stderr == "", run
