"""How far the renderer's qualities are from the path tracer. truth.py [SCENE] [SAMPLES]"""

import sys

import lanternfish as lf


def main(path: str = "demo:cornell", samples: str = "64", size: str = "160x120") -> None:
    scene, (width, height) = lf.load(path), map(int, size.split("x"))
    camera = scene.default_camera((width, height))
    truth = lf.reference(scene, camera, (width, height), spp=int(samples))["radiance"]
    for quality in ("draft", "good"):
        with lf.Renderer(scene, quality=quality) as renderer:
            image = renderer.render(camera, (width, height), "radiance")["radiance"]
        measured = lf.compare(image, truth)
        print(f"{quality:6}", *(f"{name} {measured[name]:.4f}" for name in ("flip", "relmse", "energy")))


if __name__ == "__main__":
    main(*sys.argv[1:])
