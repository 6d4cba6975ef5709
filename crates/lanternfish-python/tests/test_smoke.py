"""The wheel: it is imported, loads a scene, and renders an image that is near the path tracer's. The other files have the promises."""

import numpy as np

import lanternfish as lf


def test_an_image_of_the_wheel_is_near_the_path_tracers():
    size, scene = (48, 32), lf.load("demo:cornell")
    camera = scene.default_camera(size)
    truth = lf.reference(scene, camera, size, spp=32)["radiance"]
    with lf.Renderer(scene) as renderer:
        image = renderer.render(camera, size, ("rgb", "radiance", "depth"))
    assert [image[name].shape for name in image] == [(32, 48, 3), (32, 48, 3), (32, 48)] and image["depth"].max() > 3
    measured = lf.compare(image["radiance"], truth)
    assert 0.8 < measured["energy"] < 1.15 and measured["flip"] < 0.25, measured
    assert lf.compare(truth, truth) == {"flip": 0, "relmse": 0, "mse": 0, "energy": 1}
    shown = np.random.default_rng(1).integers(0, 256, (20, 20, 3)).astype(np.uint8)
    assert lf.compare(shown, shown)["ssim"] == 1 and lf.compare(255 - shown, shown)["flip"] > 0.3
