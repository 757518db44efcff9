"""`roboirg doctor`: check that everything needed to play an episode is installed and works.

This process imports nothing heavy. A child process (``python -m roboirg.cli.doctor --frame``) tries
the renderer, because a bad graphics driver can crash Python; a crash is then a failed check and
does not end the report.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import platform
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from roboirg.core.errors import MissingDependencyError, RenderDeviceError, RoboIRGError
from roboirg.core.extras import DISTRIBUTION, install_command
from roboirg.simulation.model_files import look_for_model_files
from roboirg.simulation.rendering.render_device import DEVICE_VARIABLE
from roboirg.util.processor import core_count

FRAME_TIMEOUT = 120.0
"""Time limit for the test frame, s."""

OLDEST_PYTHON = (3, 11)
_EXTRAS = ("sim", "report")
_GIB = 1024**3
_MIN_MEMORY = 2 * _GIB
_RENDER_REMEDY = (
    "run `make setup`, or install Mesa >= 23.2: apt-get install mesa-vulkan-drivers libvulkan1 "
    "libegl1 (see docs/install.md)"
)
# Prefixes of the lines by which the child process reports its progress.
_DEVICE_PREFIX = "device: "
_FRAME_PREFIX = "frame: "


@dataclass(frozen=True)
class Check:
    """The result of one check.

    Attributes:
        name: what was checked.
        ok: whether the check passed.
        found: what was found.
        remedy: how to fix a failure; ignored if ``ok``.
    """

    name: str
    ok: bool
    found: str
    remedy: str = ""


def run_checks() -> list[Check]:
    """Run all checks; takes a few seconds and raises nothing."""
    return [
        _check_python(),
        *_check_packages(),
        _check_opencv(),
        _check_model_files(),
        *_check_rendering(),
        Check("processors", ok=True, found=f"{core_count()}"),
        _check_memory(),
    ]


def report(checks: Sequence[Check]) -> str:
    """Return a line for each check, with a remedy below every failure."""
    width = max((len(check.name) for check in checks), default=0)
    lines: list[str] = []
    for check in checks:
        lines.append(f"{'ok  ' if check.ok else 'FAIL'}  {check.name:<{width}}  {check.found}")
        if not check.ok:
            lines.append(f"      {'':<{width}}  -> {check.remedy}")
    failures = sum(not check.ok for check in checks)
    lines.append(
        f"{failures} of {len(checks)} checks failed." if failures else "All checks passed."
    )
    return "\n".join(lines)


def run_doctor() -> int:
    """Print the report and return the exit code: 0 if every check passed, otherwise 1."""
    checks = run_checks()
    sys.stdout.write(report(checks) + "\n")
    return 0 if all(check.ok for check in checks) else 1


def _check_python() -> Check:
    wanted = ".".join(map(str, OLDEST_PYTHON))
    return Check(
        "Python",
        sys.version_info >= OLDEST_PYTHON,
        f"{platform.python_version()} ({sys.executable})",
        f"install Python {wanted} or newer and run `make setup` again",
    )


def _check_packages() -> Iterator[Check]:
    try:
        requirements = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        remedy = f"run `make setup`, or: {install_command('sim')}"
        yield Check(DISTRIBUTION, False, "not installed", remedy)
        return
    yield Check(DISTRIBUTION, True, metadata.version(DISTRIBUTION))
    wanted = {}  # several extras may list the same package
    for one in map(Requirement, requirements):
        needed = one.marker is None or any(one.marker.evaluate({"extra": it}) for it in _EXTRAS)
        if needed and one.name != DISTRIBUTION:
            wanted[one.name] = one.specifier
    for name, specifier in wanted.items():
        yield _check_package(name, specifier)


def _check_package(name: str, specifier: SpecifierSet) -> Check:
    remedy = f"pip install '{name}{specifier}'"
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return Check(name, False, f"not installed; needs {specifier}", remedy)
    if not specifier.contains(version, prereleases=True):
        return Check(name, False, f"{version}; needs {specifier}", remedy)
    return Check(name, True, version)


def _check_model_files() -> Check:
    name = "model files"
    try:
        return Check(name, True, str(look_for_model_files().root))
    except MissingDependencyError as error:
        problem, _, remedy = str(error).partition("; ")
        return Check(name, False, problem, remedy)


def _check_opencv() -> Check:
    """Load OpenCV in a child process; its wheel needs two system libraries."""
    command = [sys.executable, "-c", "import cv2; print(cv2.__version__)"]
    child = subprocess.run(  # noqa: S603 - a constant command in our own interpreter
        command, capture_output=True, text=True, check=False, timeout=FRAME_TIMEOUT
    )
    lines = (child.stdout + child.stderr).strip().splitlines() or [f"exit code {child.returncode}"]
    return Check(
        "OpenCV libraries",
        child.returncode == 0,
        "loaded" if child.returncode == 0 else lines[-1],
        "run `make setup`, or: apt-get install libgl1 libglib2.0-0",
    )


def _check_rendering() -> tuple[Check, Check]:
    """Try the renderer in a child process and report its progress."""
    code, output, fault = _run_frame_process()
    reported = {
        prefix: line.removeprefix(prefix)
        for line in output.splitlines()
        for prefix in (_DEVICE_PREFIX, _FRAME_PREFIX)
        if line.startswith(prefix)
    }
    device, frame = reported.get(_DEVICE_PREFIX), reported.get(_FRAME_PREFIX)
    drawn = frame is not None and code == 0
    chosen = os.environ.get(DEVICE_VARIABLE)
    remedy = f"unset {DEVICE_VARIABLE} (now {chosen!r}), or " if chosen else ""
    remedy += _RENDER_REMEDY
    return (
        Check("render device", device is not None, device or fault, remedy),
        Check(
            "test frame",
            drawn,
            (frame or "") if drawn else (fault if device else "not tried: no device"),
            remedy,
        ),
    )


def _run_frame_process() -> tuple[int, str, str]:
    """Return the child's exit code, its output, and a description of what went wrong."""
    command = [sys.executable, "-m", "roboirg.cli.doctor", "--frame"]
    try:
        child = subprocess.run(  # noqa: S603 - our own module in our own interpreter
            command, capture_output=True, text=True, check=False, timeout=FRAME_TIMEOUT
        )
    except subprocess.TimeoutExpired as error:
        output = error.stdout.decode() if isinstance(error.stdout, bytes) else error.stdout or ""
        return 1, output, f"no picture within {FRAME_TIMEOUT:.0f} s"
    if child.returncode < 0:
        number = -child.returncode
        return child.returncode, child.stdout, f"the driver crashed ({signal.strsignal(number)})"
    error_lines = child.stderr.strip().splitlines() or [f"exit code {child.returncode}"]
    return child.returncode, child.stdout, error_lines[-1]


def _check_memory() -> Check:
    total = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    limit = Path("/sys/fs/cgroup/memory.max")  # a container's own limit
    if limit.is_file() and (text := limit.read_text().strip()).isdigit():
        total = min(total, int(text))
    return Check(
        "memory",
        total >= _MIN_MEMORY,
        f"{total / _GIB:.1f} GiB",
        f"provide at least {_MIN_MEMORY // _GIB} GiB; each worker process takes about 0.5 GiB",
    )


def _render_test_frame() -> str:
    """Draw a lit red box; returns a description of the picture."""
    # Imported here because only the child process may load them.
    devices = importlib.import_module("roboirg.simulation.rendering.render_device")
    device = devices.describe_device(devices.find_render_device())
    kind = "drawn by the processor" if device.is_software else "GPU"
    # Flushed at once, because the next lines may crash this process.
    sys.stdout.write(f"{_DEVICE_PREFIX}{device.name} at {device.alias} ({kind})\n")
    sys.stdout.flush()

    start = time.perf_counter()
    sapien, np = importlib.import_module("sapien"), importlib.import_module("numpy")
    scene = sapien.Scene([sapien.physx.PhysxCpuSystem(), devices.render_system()])
    scene.set_ambient_light([0.3, 0.3, 0.3])
    scene.add_directional_light([1.0, 0.2, -1.0], [1.0, 1.0, 1.0])
    builder = scene.create_actor_builder()
    red = sapien.render.RenderMaterial(base_color=[0.9, 0.05, 0.05, 1.0])
    builder.add_box_visual(half_size=[0.1, 0.1, 0.1], material=red)
    builder.set_initial_pose(sapien.Pose([1.0, 0.0, 0.0]))
    builder.build_static()
    sapien.render.set_camera_shader_dir("minimal")
    camera = scene.add_camera("camera", 64, 64, 1.0, 0.01, 10.0)
    # Otherwise SAPIEN spends seconds on a light table that this picture does not need.
    table = sapien.render.RenderTexture(np.zeros((2, 2, 4), np.uint8), 2, "r8g8b8a8unorm")
    camera.set_texture("BRDFLUT", table)
    scene.update_render()
    camera.take_picture()
    picture = camera.get_picture("Color")
    middle, corner = picture[32, 32, :3], picture[0, 0, :3]
    if not _is_reddish(middle) or _is_reddish(corner):
        raise RenderDeviceError(
            f"the picture of a red box has the color {np.round(middle, 2).tolist()} in the "
            f"middle and {np.round(corner, 2).tolist()} in the corner."
        )
    return f"64 x 64 pixels in {time.perf_counter() - start:.1f} s"


def _is_reddish(color: Sequence[float]) -> bool:
    red, green, blue = (float(part) for part in color)
    return red > 0.2 and red > 2 * max(green, blue)  # noqa: PLR2004 - relative to full brightness


def _main() -> int:
    if "--frame" not in sys.argv[1:]:
        return run_doctor()
    try:
        sys.stdout.write(f"{_FRAME_PREFIX}{_render_test_frame()}\n")
    except RoboIRGError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(_main())
