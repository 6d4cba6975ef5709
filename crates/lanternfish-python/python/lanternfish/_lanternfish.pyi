from typing import Any

__version__: str
OUTPUTS: list[str]

class Error(RuntimeError):
    """What Lanternfish cannot do, with the remedy."""

class NoAdapter(Error):
    """There is no adapter to render with."""

class Moment:
    """A scene with a camera at one time: of `Renderer.moment`."""

def settings() -> dict[str, tuple[list[str], str]]:
    """Every setting of a `Renderer`: its names of values, if it has such, and its meaning."""

# What the package's own modules use.
def __getattr__(name: str) -> Any: ...
