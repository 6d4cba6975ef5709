"""The renderer, the path tracer, and comparisons."""

from __future__ import annotations

import contextlib
import threading
from typing import Any, Callable, Iterator, Sequence

import numpy as np

from . import _check, _driver, _lanternfish
from ._image import Images
from ._objects import Camera, Light, _factors
from ._scene import Scene, _found

Progress = Callable[[int, int], Any]
# What a thread works with: it would wait for itself.
_thread = threading.local()


def _texts(settings: dict[str, Any]) -> list[tuple[str, str]]:
    """Settings as the library reads them: `tone_map=None` is `tone-map none`."""
    def text(value: Any) -> str:
        if isinstance(value, (bool, type(None))):
            return {True: "on", False: "off", None: "none"}[value]
        return ",".join(map(text, value)) if isinstance(value, (tuple, list)) else str(value)

    return [(name.replace("_", "-"), text(value)) for name, value in settings.items()]


class Renderer:
    """Renders a scene, which it keeps on the device with its tree and compiled shaders.

    `quality`: "draft", "good", "best" or "realtime". `adapter`: "auto", "gpu", "cpu" or a part of a name. `light_rig`:
    "auto" (one for scenes without light, around the first camera), "studio", "sun" or "none". All other keywords are
    settings of the library by the names of the command line's flags, with underscores: `accumulate=16`,
    `indirect="none"`, `background="transparent"`,
    `exposure=0`, `tone_map="none"`; `lanternfish.settings()` lists them.

    The scene is taken as it is: later changes of it need `update`. Threads may share a renderer and wait for each
    other. A renderer is a context manager, and `close` frees what it holds.
    """

    def __init__(
        self, scene: Scene, quality: str = "good", *, adapter: str = "auto", light_rig: str = "auto", **settings: Any
    ) -> None:
        device = _driver.device(adapter)
        self._data = _lanternfish.RendererData(device, scene._data, quality, light_rig, _texts(settings))
        self._scene, self._lock, self.adapter = Scene(scene._data.copy()), threading.Lock(), device.name

    @contextlib.contextmanager
    def _alone(self) -> Iterator[tuple[Any, Any]]:
        """What renders, and its scene, while no other thread has them."""
        _lanternfish.check_process()
        if getattr(_thread, "is_busy", False):
            raise _lanternfish.Error("a renderer is used within its own progress: let the call return first")
        with self._lock:
            if self._data is None:
                raise _lanternfish.Error("the renderer is closed: make another one")
            _thread.is_busy = True
            try:
                yield self._data, self._scene._data
            finally:
                _thread.is_busy = False

    def render(
        self, cameras: Camera | Sequence[Camera] | None = None, size: tuple[int, int] | None = None,
        outputs: str | Sequence[str] = ("rgb",), *, towards: _lanternfish.Moment | None = None,
        progress: Progress | None = None,
    ) -> Images:
        """Renders one image for each camera: arrays by the names in `outputs`, N x height x width (x channels); of one
        camera alone, height x width. Rows from the top. Without cameras, the scene's first one, or one that frames it.

        | output | array |
        |---|---|
        | `rgb`, `rgba` | display colours, 8 bits, sRGB; alpha is the opacity with `background="transparent"` |
        | `radiance` | nits, linear Rec. 709, float32 |
        | `depth`, `distance` | m along the view axis, and along the pixel's ray; 0: no surface |
        | `position`, `normal`, `albedo` | world space, m; unit vector; linear base colour |
        | `motion` | pixels, x right and y down, from here to the moment `towards` (`moment`) |
        | `instance`, `material`, `semantic` | ids, uint32; 0: none. Never a mix of two surfaces |

        `size`: width and height, pixels; by default those of the camera, else 640 x 480. `progress(done, all)` is
        called after each frame.
        """
        is_single = cameras is None or isinstance(cameras, Camera)
        given = [cameras] if isinstance(cameras, Camera) else list(cameras or ())
        wrong = [type(camera).__name__ for camera in given if not isinstance(camera, Camera)]
        if wrong or not (given or is_single):
            raise ValueError(f"cameras: one Camera or several are meant, not {wrong[0] if wrong else 'none'}")
        sizes = {camera.size for camera in given if camera.size is not None}
        if size is None and len(sizes) > 1:
            raise ValueError(f"the cameras are for images of {sorted(sizes)}: render those of one size, or name a size")
        size = _check.size(size or next(iter(sizes), (640, 480)))
        names = [outputs] if isinstance(outputs, str) else list(outputs)
        with self._alone() as (data, scene):
            given = given or [scene.default_camera(size[0] / size[1])]
            images = data.render(scene, given, size, names, towards, progress)
        return Images(images[0] if is_single else {name: np.stack([image[name] for image in images]) for name in names})

    def moment(self, camera: Camera) -> _lanternfish.Moment:
        """The scene as it is now, seen by a camera: what the output `motion` leads to, before or after it."""
        with self._alone() as (data, scene):
            return data.moment(scene, camera)

    def set_pose(self, which: int | str, pose: Any) -> None:
        """Moves an instance, by name or id: 4 x 4, world from object. Only the matrix is uploaded, at the next image.
        """
        self.set_poses({which: pose})

    def set_poses(self, poses: dict[Any, Any]) -> None:
        """Moves instances, by name or id."""
        with self._alone() as (data, scene):
            ids = map(self._scene._instance, poses)
            data.set_poses(scene, list(zip(ids, map(_check.pose, poses.values()))))

    def set_light(self, which: int | str, light: Light) -> None:
        """Replaces a light, by name or index."""
        with self._alone() as (data, scene):
            index = _found(which, scene.light_names, 0, "light")
            scene.set_light(index, light)
            data.send_light(scene, index)

    def set_lights(self, lights: Sequence[Light]) -> None:
        """Replaces all lights. A rig that was added stays: `light_rig="none"` renders with these alone."""
        with self._alone() as (data, scene):
            data.set_lights(scene, list(lights))

    def set_material(self, which: int | str, **properties: Any) -> None:
        """Changes properties of a material, by name or number from 1 on: the fields of `Material` but its textures."""
        with self._alone() as (data, scene):
            index = _found(which, scene.materials, 1, "material")
            scene.set_material(index, _factors(properties))
            data.send_material(scene, index)

    def update(self, scene: Scene) -> None:
        """Takes a changed scene. Uploads what differs."""
        with self._alone() as (data, _):
            changed = Scene(scene._data.copy())
            data.update(changed._data)
            self._scene = changed

    def set_time(self, time: float, animation: int = 0) -> None:
        """Moves the scene to a time of an animation, s. `cameras` are then those of that time."""
        with self._alone() as (data, scene):
            scene.set_time(int(_check.array(animation, (), "animation", np.uint32)), _check.number(time, "time"))
            data.send(scene)

    @property
    def cameras(self) -> list[Camera]:
        """The scene's cameras."""
        with self._alone() as (_, scene):
            return scene.cameras

    @property
    def exposure(self) -> float | None:
        """Exposure of display images, EV. The first image is metered and sets that of all later ones; before it, None.

        Set a number, or "auto" to meter the next image.
        """
        with self._alone() as (data, _):
            return data.exposure

    @exposure.setter
    def exposure(self, value: float | str) -> None:
        with self._alone() as (data, _):
            data.exposure = str(value)

    @property
    def sent_bytes(self) -> int:
        """Bytes that the last moves sent to the device."""
        with self._alone() as (data, _):
            return data.sent_bytes

    def close(self) -> None:
        """Frees what the renderer holds. It cannot be used afterwards."""
        if self._data is not None:
            with self._alone():
                self._data = None

    def __enter__(self) -> "Renderer":
        return self

    def __exit__(self, *_: Any) -> None:
        self.close()


def reference(
    scene: Scene, camera: Camera | None = None, size: tuple[int, int] | None = None, spp: int = 64, *, seed: int = 0,
    max_depth: int = 2**32 - 1, light_rig: str = "auto", progress: Progress | None = None, **settings: Any,
) -> Images:
    """The path tracer's image, on the processor's cores: needs no adapter. `spp`: samples per pixel.

    Arrays: `radiance` (nits, unbiased), and at pixels' centres `instance`, `material` and `distance` as of
    `Renderer.render`. `settings`: those of materials, attenuation and size of lights (`light_radius`, `sun_diameter`).
    """
    size = _check.size(size or (camera.size if camera else None) or (640, 480))
    camera = camera or scene.default_camera(size)
    numbers = _check.array([spp, seed, max_depth], (3,), "spp, seed, max_depth", np.uint32).tolist()
    if 0 in numbers[::2]:
        raise ValueError(f"spp is {spp} and max_depth {max_depth}: at least 1 sample and a depth of 1 are meant")
    return Images(_lanternfish.reference(
        scene._data, camera, size, *numbers, light_rig, _texts(settings), progress))


def compare(image: Any, reference: Any) -> dict[str, float]:
    """Errors of an image against a reference: two arrays of radiance (float), or of display colours (8 bits).

    `flip`: mean FLIP (HDR-FLIP of radiance), 0 for equal images. `relmse`, `mse`. `energy`: sum over the reference's
    sum. Of display colours also `psnr`, dB, and `ssim`. Pixels that are not finite are left out.
    """
    images = [np.asarray(image), np.asarray(reference)]
    is_display = [array.dtype == np.uint8 for array in images]
    if is_display[0] != is_display[1]:
        raise ValueError("compare: both are radiance (float), or both are display colours (uint8)")
    for array in images:
        if array.ndim != 3 or array.shape[2] not in (3, 4) or array.dtype.kind not in "fu" or not array.size:
            raise ValueError(f"compare: rows x columns x 3 are meant, not {array.dtype} of {array.shape}")
    scale = 255.0 if is_display[0] else 1.0
    a, b = (np.ascontiguousarray(array[..., :3] / scale, dtype=np.float32) for array in images)
    return _lanternfish.compare(a, b, is_display[0])
