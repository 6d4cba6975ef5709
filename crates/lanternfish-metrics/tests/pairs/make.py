"""Makes the images of this folder and what other programs say about them.

    python3 -m venv venv
    venv/bin/pip install flip-evaluator==1.7 scikit-image==0.25.0 numpy pillow
    venv/bin/python make.py

The images are drawn here, from seeds. `expected.csv` is what the authors' evaluator of FLIP (flip-evaluator 1.7 of
PyPI) and scikit-image 0.25.0 measure on the files as they are stored: halves, and bytes.
"""

import csv
import os
import struct
import zlib

import flip_evaluator
import numpy as np
from PIL import Image
from skimage.metrics import structural_similarity

WIDTH, HEIGHT = 96, 64
HERE = os.path.dirname(os.path.abspath(__file__))


def write_exr(name, image):
    """B, G, R as halves, ZIP, 16 lines a block: the OpenEXR file layout, single part, scan lines."""
    height, width, _ = image.shape
    attribute = lambda name, kind, value: name + b"\0" + kind + b"\0" + struct.pack("<i", len(value)) + value
    channels = b"".join(c + b"\0" + struct.pack("<iBxxxii", 1, 0, 1, 1) for c in (b"B", b"G", b"R")) + b"\0"
    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    header = struct.pack("<ii", 20000630, 2)
    header += attribute(b"channels", b"chlist", channels)
    header += attribute(b"compression", b"compression", b"\x03")
    header += attribute(b"dataWindow", b"box2i", window) + attribute(b"displayWindow", b"box2i", window)
    header += attribute(b"lineOrder", b"lineOrder", b"\0")
    header += attribute(b"pixelAspectRatio", b"float", struct.pack("<f", 1))
    header += attribute(b"screenWindowCenter", b"v2f", struct.pack("<2f", 0, 0))
    header += attribute(b"screenWindowWidth", b"float", struct.pack("<f", 1)) + b"\0"
    blocks = []
    for y in range(0, height, 16):
        rows = image[y : y + 16].astype("<f2")
        raw = np.frombuffer(b"".join(row[:, 2 - c].tobytes() for row in rows for c in range(3)), np.uint8)
        halves = np.concatenate([raw[0::2], raw[1::2]]).astype(int)
        predicted = np.concatenate([halves[:1], (halves[1:] - halves[:-1] + 128) & 255]).astype(np.uint8)
        packed = zlib.compress(predicted.tobytes(), 9)
        packed = packed if len(packed) < len(raw) else raw.tobytes()
        blocks.append(struct.pack("<ii", y, len(packed)) + packed)
    offset = len(header) + 8 * len(blocks)
    table = b""
    for block in blocks:
        table += struct.pack("<Q", offset)
        offset += len(block)
    with open(os.path.join(HERE, name + ".exr"), "wb") as file:
        file.write(header + table + b"".join(blocks))


def write_png(name, image):
    encoded = np.where(image <= 0.0031308, 12.92 * image, 1.055 * np.maximum(image, 1e-9) ** (1 / 2.4) - 0.055)
    Image.fromarray((encoded.clip(0, 1) * 255 + 0.5).astype(np.uint8)).save(os.path.join(HERE, name + ".png"), optimize=True)


def scene(dim):
    """A floor of tiles, walls that fade, balls, and lamps; `dim`: nearly all of it in the dark."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH].astype(float)
    image = np.stack([0.3 + x / 200, 0.25 + y / 300, 0.4 - x / 400], -1) * (0.2 + y[..., None] / HEIGHT)
    tiles = ((x // 7 + y // 5) % 2)[..., None]
    image = np.where((y > 40)[..., None], image * (0.4 + tiles), image)
    for cx, cy, radius, color in [(25, 35, 12, (0.9, 0.2, 0.1)), (60, 42, 9, (0.1, 0.6, 0.9)), (80, 30, 7, (0.9, 0.9, 0.2))]:
        inside = (x - cx) ** 2 + (y - cy) ** 2 < radius**2
        light = np.maximum(0.05, 1 - ((x - cx + radius / 2) ** 2 + (y - cy + radius / 2) ** 2) / (2 * radius**2))
        image[inside] = (light[..., None] * np.array(color))[inside]
    if dim:
        image *= 0.002
    for cx, cy, radius, nits in [(15, 8, 3, 60.0), (50, 6, 2, 900.0), (85, 10, 1.5, 6000.0)]:
        image[(x - cx) ** 2 + (y - cy) ** 2 < radius**2] = np.array([1.0, 0.9, 0.7]) * nits
    return image


def blurred(image):
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), "edge")
    return sum(padded[j : j + HEIGHT, i : i + WIDTH] for j in range(3) for i in range(3)) / 9


def drawn_images():
    noise = np.random.default_rng(20210503)
    grain = lambda scale: 1 + scale * noise.standard_normal((HEIGHT, WIDTH, 3))
    bright, dim = scene(False), scene(True)
    fireflies = bright.copy()
    fireflies[noise.integers(0, HEIGHT, 25), noise.integers(0, WIDTH, 25)] *= 200
    return {
        "scene": bright,
        "scene-noise": np.maximum(0, bright * grain(0.2)),
        "scene-fireflies": fireflies,
        "scene-shifted": np.roll(bright, 1, 1),
        "scene-tinted": bright * np.array([0.9, 1.0, 1.1]),
        "dim": dim,
        "dim-unlit": np.where(dim > 100, 0.001, dim),
        "dim-blurred": blurred(dim),
    }


def main():
    images = drawn_images()
    rows = []
    for name, image in images.items():
        write_exr(name, image)
    for name in ["scene", "scene-noise", "scene-shifted", "scene-tinted"]:
        write_png(name, images[name])
    write_png("scene-blurred", blurred(np.minimum(images["scene"], 1)))

    def row(reference, test, tone_mapper, parameters):
        a, b = (os.path.join(HERE, name) for name in (reference, test))
        kind = "HDR" if tone_mapper else "LDR"
        parameters = dict(parameters, tonemapper=tone_mapper) if tone_mapper else parameters
        errors, mean, used = flip_evaluator.evaluate(a, b, kind, applyMagma=False, parameters=parameters)
        errors = errors.reshape(HEIGHT, WIDTH)
        ssim = ""
        if kind == "LDR":
            luma = lambda path: np.asarray(Image.open(path)).astype(float) / 255 @ np.array([0.2126, 0.7152, 0.0722])
            settings = dict(data_range=1.0, gaussian_weights=True, sigma=1.5, truncate=3.4, use_sample_covariance=False)
            ssim = f"{structural_similarity(luma(a), luma(b), **settings):.7f}"
        rows.append(
            [reference, test, tone_mapper or "", f"{used['ppd']:.4f}"]
            + [used[key] if tone_mapper else "" for key in ("startExposure", "stopExposure", "numExposures")]
            + [f"{mean:.7f}"]
            + [f"{errors[y, x]:.6f}" for x, y in ((0, 0), (50, 6), (30, 45))]
            + [ssim]
        )

    for test in ["scene-noise", "scene-shifted", "scene-tinted", "scene-blurred"]:
        row("scene.png", test + ".png", "", {})
    row("scene.png", "scene-noise.png", "", {"ppd": 30.0})
    for test in ["scene-noise", "scene-fireflies", "scene-shifted", "scene-tinted"]:
        for tone_mapper in ["aces", "hable", "reinhard"]:
            row("scene.exr", test + ".exr", tone_mapper, {})
    for test in ["dim-unlit", "dim-blurred"]:
        for tone_mapper in ["aces", "hable", "reinhard"]:
            row("dim.exr", test + ".exr", tone_mapper, {})
    row("dim-unlit.exr", "dim.exr", "aces", {})
    row("scene.exr", "scene-noise.exr", "aces", {"ppd": 30.0})
    row("scene.exr", "scene-tinted.exr", "aces", {"startExposure": -2.0, "stopExposure": 3.0, "numExposures": 4})

    with open(os.path.join(HERE, "expected.csv"), "w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(
            ["reference", "test", "tone_mapper", "pixels_per_degree", "start", "stop", "count", "flip_mean"]
            + ["flip_0_0", "flip_50_6", "flip_30_45", "ssim"]
        )
        writer.writerows(rows)


main()
