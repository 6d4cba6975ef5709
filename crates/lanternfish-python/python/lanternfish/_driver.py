"""Finds what to render with: the machine's adapters, else the software driver of the package `lanternfish-lavapipe`."""

from __future__ import annotations

import contextlib
import ctypes
import os
import stat
import tempfile
import threading
from typing import Iterator

from . import _lanternfish

_devices: dict[str, _lanternfish.Device] = {}
_lock = threading.Lock()


def device(adapter: str) -> _lanternfish.Device:
    """The device of an adapter: "auto", "cpu", "gpu" or a part of its name. Opened once for a process."""
    with _lock:
        if adapter not in _devices:
            with _environment(**_quiet(), **_shader_cache()):
                _devices[adapter] = _open(adapter)
        return _devices[adapter]


def _open(adapter: str) -> _lanternfish.Device:
    try:
        return _lanternfish.Device(adapter)
    except _lanternfish.NoAdapter as error:
        variables = _packaged()
        if not variables:
            raise _lanternfish.NoAdapter(f"{error}; or `pip install lanternfish-lavapipe`: one for Python") from None
    with _environment(**variables):
        return _lanternfish.Device(adapter)


def for_program() -> None:
    """Lets the rest of this process, and those that it starts, find an adapter and a folder for compiled shaders."""
    os.environ.update(_quiet() | _shader_cache())
    if not _lanternfish.has_adapter():
        os.environ.update(_packaged())


def _packaged() -> dict[str, str]:
    """Loads the loader of the software driver's package. The variables with which it finds the driver; none without the package."""
    try:
        import lanternfish_lavapipe as driver  # type: ignore[import-not-found]
    except ImportError:
        return {}
    # wgpu asks for `libvulkan.so.1` by this name; a loaded library of the name is taken.
    ctypes.CDLL(str(driver.loader()), mode=ctypes.RTLD_GLOBAL)
    return {"VK_ADD_DRIVER_FILES": str(driver.icd())}


def _quiet() -> dict[str, str]:
    """Without a desktop, a layer of old Mesa drivers prints that it cannot ask for the preferred adapter."""
    return {} if "XDG_RUNTIME_DIR" in os.environ else {"NODEVICE_SELECT": "1"}


def _shader_cache() -> dict[str, str]:
    """A folder for compiled shaders, where Mesa's own is not writable: without one every process compiles all."""
    if "MESA_SHADER_CACHE_DIR" in os.environ:
        return {}
    usual = os.environ.get("XDG_CACHE_HOME") or os.path.join(os.path.expanduser("~"), ".cache")
    while not os.path.exists(usual) and usual != os.path.dirname(usual):
        usual = os.path.dirname(usual)
    if os.access(usual, os.W_OK | os.X_OK):
        return {}
    user = getattr(os, "getuid", int)()
    folder = os.path.join(tempfile.gettempdir(), f"lanternfish-shaders-{user}")
    with contextlib.suppress(FileExistsError):
        os.mkdir(folder, 0o700)
    # It holds code that runs: another user's folder of this name is left alone.
    found = os.lstat(folder)
    if not stat.S_ISDIR(found.st_mode) or found.st_uid != user or found.st_mode & 0o022:
        folder = tempfile.mkdtemp(prefix="lanternfish-shaders-")
    return {"MESA_SHADER_CACHE_DIR": folder}


@contextlib.contextmanager
def _environment(**variables: str) -> Iterator[None]:
    """Environment variables for the making of one device; other users of Vulkan see no change."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value
