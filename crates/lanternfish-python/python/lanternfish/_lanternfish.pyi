from typing import Any

import numpy as np

__version__: str
OUTPUTS: list[str]

class Error(RuntimeError):
    """What Lanternfish cannot do, with the remedy."""

class NoAdapter(Error):
    """There is no adapter to render with."""

class Device:
    name: str
    def __init__(self, adapter: str) -> None: ...

class Moment:
    """A scene with a camera at one time: of `Renderer.moment`."""

class SceneData:
    @staticmethod
    def load(path: str, up: str, scene: str | None, variant: str | None) -> SceneData: ...
    def copy(self) -> SceneData: ...
    def __getattr__(self, name: str) -> Any: ...

class RendererData:
    exposure: Any
    sent_bytes: int
    def __init__(
        self, device: Device, scene: SceneData, quality: str, light_rig: str, settings: list[tuple[str, str]]
    ) -> None: ...
    def render(
        self, cameras: list[dict[str, Any]], size: tuple[int, int], outputs: list[str], towards: Moment | None,
        progress: Any,
    ) -> dict[str, np.ndarray]: ...
    def moment(self, camera: dict[str, Any]) -> Moment: ...
    def __getattr__(self, name: str) -> Any: ...

def settings() -> list[tuple[str, list[str], str]]: ...
def reference(*arguments: Any) -> dict[str, np.ndarray]: ...
def compare(image: np.ndarray, reference: np.ndarray, is_display: bool) -> dict[str, float]: ...
