"""A Vulkan driver for the processor (Mesa's lavapipe) and a Vulkan loader, for machines that have neither.

Importing this changes nothing. Whoever starts a Vulkan program sets ``VK_ADD_DRIVER_FILES`` to ``icd()``: the driver is
then found beside those of the system.
"""

from pathlib import Path

_LIB = Path(__file__).resolve().parent / "lib"


def icd() -> str:
    """The path of the driver's manifest, for ``VK_ADD_DRIVER_FILES``."""
    return str(_LIB / "lvp_icd.json")


def loader() -> str:
    """The path of ``libvulkan.so.1``, for a process that finds no loader of the system."""
    return str(_LIB / "libvulkan.so.1")
