from typing import Any, Dict, List, Optional, Tuple

import numpy as np

__version__: str
OUTPUTS: List[str]

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
    def load(path: str, up: str, scene: Optional[str], variant: Optional[str]) -> SceneData: ...
    def copy(self) -> SceneData: ...
    def __getattr__(self, name: str) -> Any: ...

class RendererData:
    exposure: Any
    sent_bytes: int
    def __init__(
        self, device: Device, scene: SceneData, quality: str, light_rig: str, settings: List[Tuple[str, str]]
    ) -> None: ...
    def render(
        self, cameras: List[Dict[str, Any]], size: Tuple[int, int], outputs: List[str], towards: Optional[Moment], progress: Any
    ) -> Dict[str, np.ndarray]: ...
    def moment(self, camera: Dict[str, Any]) -> Moment: ...
    def __getattr__(self, name: str) -> Any: ...

def settings() -> List[Tuple[str, List[str], str]]: ...
def reference(*arguments: Any) -> Dict[str, np.ndarray]: ...
def compare(image: np.ndarray, reference: np.ndarray, is_display: bool) -> Dict[str, float]: ...
