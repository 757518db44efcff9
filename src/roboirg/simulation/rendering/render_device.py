"""Choice of the render device: a GPU if one can render, otherwise Mesa's lavapipe.

The environment variable ``ROBOIRG_RENDER_DEVICE`` overrides the choice with SAPIEN's name for a
device: ``cuda:0``, ``pci:0000:01:00.0`` or ``pci:1`` (the number of the PCI bus, hexadecimal).
"""

from __future__ import annotations

import functools
import importlib
import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING

from roboirg.core.errors import RenderDeviceError
from roboirg.core.extras import extra_needed
from roboirg.core.waiting import DRAWING

if TYPE_CHECKING:
    import sapien

DEVICE_VARIABLE = "ROBOIRG_RENDER_DEVICE"
DRIVER_VARIABLES = ("VK_ICD_FILENAMES", "VK_DRIVER_FILES")
"""Environment variables that hide all drivers of Vulkan but those that they name."""

REMEDY = (
    "install Mesa >= 23.2 (mesa-vulkan-drivers, libvulkan1, libegl1; `make setup` does it) "
    "or the Vulkan driver of your GPU"
)

# Lavapipe is not on the PCI bus and reports this address; "cpu" is SAPIEN's name for the
# processor as a physics device and cannot render.
_SOFTWARE_ALIAS = "pci:0000:00:00.0"
_SOFTWARE_NAMES = ("llvmpipe", "lavapipe", "swiftshader")
"""Parts of the names of devices with which the processor draws."""
_PCI_DEVICES = Path("/sys/bus/pci/devices")
_DISPLAY_CLASS = "0x03"
"""Beginning of the class of PCI devices that are display controllers."""
_MAX_CUDA_DEVICES = 64


@dataclass(frozen=True)
class RenderDevice:
    """Description of a render device.

    Attributes:
        name: the driver's name of the device, such as ``"llvmpipe (LLVM 15.0.6, 256 bits)"``.
        alias: SAPIEN's name of the device, valid for ``ROBOIRG_RENDER_DEVICE``.
        is_software: whether the processor draws the pictures.
    """

    name: str
    alias: str
    is_software: bool


def describe_device(device: sapien.Device) -> RenderDevice:
    """Return the description of a SAPIEN device."""
    name = str(device.name)
    has_cuda = device.cuda_id >= 0
    alias = f"cuda:{device.cuda_id}" if has_cuda else f"pci:{device.pci_string}"
    is_software = any(word in name.lower() for word in _SOFTWARE_NAMES)
    return RenderDevice(name, alias, is_software)


def find_render_device() -> sapien.Device:
    """Return the device that draws the pictures.

    It is the one that ``ROBOIRG_RENDER_DEVICE`` names, or the first GPU that can render, else
    lavapipe.

    Raises:
        MissingDependencyError: SAPIEN is not installed.
        RenderDeviceError: the named device cannot render or does not exist, or none can.
    """
    name = os.environ.get(DEVICE_VARIABLE)
    if name:
        return _named_device(name)
    first_software: sapien.Device | None = None
    for device in _rendering_devices():
        if not describe_device(device).is_software:
            return device
        first_software = first_software or device
    if first_software is None:
        raise RenderDeviceError(
            f"No Vulkan device can render; {to_unset(*DRIVER_VARIABLES)}{REMEDY}."
        )
    return first_software


def render_system(*, keep_engine: bool = True) -> sapien.render.RenderSystem:
    """Return a new render system for one scene.

    Scenes that share a render system corrupt each other's pictures.

    SAPIEN frees its whole render engine (shaders, meshes, tables) with the last system, and
    creating it again takes seconds. With `keep_engine`, the first call therefore also creates a
    system that lives as long as the process. SAPIEN renders on one device per process, so
    ``ROBOIRG_RENDER_DEVICE`` is read once.
    """
    if keep_engine:
        _engine_keeper()
    return _new_system(_chosen_device())


@functools.cache
def _chosen_device() -> sapien.Device:
    """Return the device that this process draws on."""
    return find_render_device()


@functools.cache
def _engine_keeper() -> sapien.render.RenderSystem:
    """Return a render system that lives as long as the process, and no scene uses."""
    return _new_system(_chosen_device())


def _new_system(device: sapien.Device) -> sapien.render.RenderSystem:
    """Return a new render system on a device.

    Raises:
        RenderDeviceError: the device cannot render.
    """
    try:
        with DRAWING:
            return _sapien().render.RenderSystem(device)
    except RuntimeError as error:
        found = describe_device(device)
        raise RenderDeviceError(
            f"SAPIEN cannot render on {found.alias} ({found.name}): {error}; {REMEDY}."
        ) from error


def to_unset(*names: str) -> str:
    """Return advice to unset environment variables, to be followed by other advice.

    For example ``unset VK_DRIVER_FILES (now '/x'), or ``; nothing if none of them is set.
    """
    found = [f"{name} (now {os.environ[name]!r})" for name in names if os.environ.get(name)]
    if not found:
        return ""
    return f"unset {' and '.join(found)}, or "


@functools.cache
def _sapien() -> ModuleType:
    """Import SAPIEN, which says less than usual from then on."""
    with extra_needed("Playing episodes needs the simulator", "sim"):
        # By name, so that this module loads without SAPIEN.
        sapien = importlib.import_module("sapien")
    # Below "error", SAPIEN reports missing extensions that only its viewer window needs.
    sapien.set_log_level("error")
    sapien.render.set_log_level("error")
    return sapien


def _device(alias: str) -> sapien.Device | None:
    """Return the device that SAPIEN finds by a name; None if there is none."""
    try:
        with DRAWING:
            return _sapien().Device(alias)
    except (RuntimeError, ValueError, IndexError):
        # RuntimeError: no such device; the others: SAPIEN could not parse the number in the name.
        return None


def _named_device(name: str) -> sapien.Device:
    """Return a device that the user has named; see `find_render_device` for the errors."""
    named = _device(name)
    if named is not None and named.can_render():
        return named
    aliases = [describe_device(device).alias for device in _rendering_devices()]
    if not aliases:
        raise RenderDeviceError(
            f"The render device {name!r} cannot be used; {to_unset(*DRIVER_VARIABLES)}{REMEDY}."
        )
    fault = "does not exist" if named is None else "cannot render"
    different = dict.fromkeys(aliases)
    raise RenderDeviceError(
        f"The render device {name!r} {fault}; set {DEVICE_VARIABLE} to one of "
        f"{', '.join(different)}."
    )


def _rendering_devices() -> Iterator[sapien.Device]:
    """Yield the devices that can render, GPUs first; a GPU can appear under two names."""
    for alias in _aliases():
        device = _device(alias)
        if device is not None and device.can_render():
            yield device


def _aliases() -> Iterator[str]:
    """Yield names of devices that may exist, GPUs first: SAPIEN has no list of devices."""
    for number in range(_MAX_CUDA_DEVICES):
        if _device(f"cuda:{number}") is None:
            break
        yield f"cuda:{number}"
    for address in sorted(_PCI_DEVICES.glob("*")):
        kind = address / "class"
        if kind.is_file() and kind.read_text().startswith(_DISPLAY_CLASS):
            yield f"pci:{address.name}"
    yield _SOFTWARE_ALIAS
