from typing import Any

import numpy as np

__version__: str
OUTPUTS: list[str]

class Error(RuntimeError):
    """What Lanternfish cannot do, with the remedy."""

class NoAdapter(Error):
    """There is no adapter to render with."""

class Moment:
    """A scene with a camera at one time: of `Renderer.moment`."""

class Device:
    name: str
    def __init__(self, adapter: str) -> None: ...

class SceneData:
    @staticmethod
    def load(path: str, up: str, scene: str | None, variant: str | None) -> SceneData: ...
    def __getattr__(self, name: str) -> Any: ...

class RendererData:
    exposure: Any
    def __init__(self, device: Device, *arguments: Any) -> None: ...
    def __getattr__(self, name: str) -> Any: ...

def has_adapter() -> bool: ...
def command(program: list[str], arguments: list[str]) -> int: ...
def settings() -> list[tuple[str, list[str], str]]: ...
def reference(*arguments: Any) -> dict[str, np.ndarray]: ...
def compare(image: np.ndarray, reference: np.ndarray, is_display: bool) -> dict[str, float]: ...
