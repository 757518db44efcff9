"""`roboirg doctor`: check that everything needed to play an episode is installed and works.

This process imports nothing heavy. A child process (``python -m roboirg.cli.doctor --frame``, with
seconds to go on drawing) tries the renderer, because a bad graphics driver can crash Python or
hang; that is then a failed check and does not end the report.
"""

from __future__ import annotations

import mmap
import os
import platform
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import typer
from packaging.requirements import Requirement
from packaging.specifiers import SpecifierSet

from roboirg.core.errors import MissingDependencyError, RenderDeviceError, RoboIRGError
from roboirg.core.extras import DISTRIBUTION, install_command
from roboirg.simulation.model_files import look_for_model_files
from roboirg.simulation.rendering.render_device import (
    DEVICE_VARIABLE,
    DRIVER_VARIABLES,
    to_unset,
)
from roboirg.util.cache import cache_folder
from roboirg.util.processor import core_count, worker_advice
from roboirg.util.proxies import proxy_of

if TYPE_CHECKING:
    from roboirg.simulation.world import World

FRAME_TIMEOUT = 120
"""Time limit for the test frame, and then for each picture, s."""

_EXTRAS = ("sim", "report")
_MODULES = {"opencv-python": "cv2"}
"""Modules of packages that others bring as well, such as opencv-python-headless."""
_GIB = 1024**3
_MIN_MEMORY = 2 * _GIB
_RENDER_REMEDY = (
    "run `make setup`, or install Mesa >= 23.2: apt-get install mesa-vulkan-drivers libvulkan1 "
    "libegl1 (see docs/install.md)"
)
_FEWEST_COLORS = 100
"""In a picture of a scene, which has thousands."""


_MOVE_EVERY = 4
"""Pictures after which the robot is set elsewhere for a step: it must move, or nothing is drawn."""


class _Child(NamedTuple):
    """What came of a child process.

    Attributes:
        is_ok: whether it succeeded.
        output: what it wrote.
        fault: what is wrong if it failed.
    """

    is_ok: bool
    output: str
    fault: str


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


def run_checks(render_s: int = 0) -> list[Check]:
    """Run all checks, in seconds, or half a minute where no mesh is cached yet; raises nothing.

    Args:
        render_s: seconds to go on drawing after the test frame.
    """
    return [
        Check("Python", ok=True, found=f"{platform.python_version()} ({sys.executable})"),
        *_check_packages(),
        _check_opencv(),
        *_check_files(),
        *_check_rendering(render_s),
        Check("processors", ok=True, found=f"{core_count()}; workers: {worker_advice()}"),
        _check_memory(),
    ]


def report(checks: Sequence[Check]) -> str:
    """Return a line for each check, with a remedy below every failure, and last how many failed."""
    width = max((len(check.name) for check in checks), default=0)
    lines = []
    failures = 0
    for check in checks:
        verdict = "ok  " if check.ok else "FAIL"
        lines.append(f"{verdict}  {check.name:<{width}}  {check.found}")
        if not check.ok:
            failures += 1
            lines.append(f"      {'':<{width}}  -> {check.remedy}")
    if failures:
        lines.append(f"{failures} of {len(checks)} checks failed.")
    else:
        lines.append("All checks passed.")
    return "\n".join(lines)


def run_doctor(render_s: int = 0) -> int:
    """Print the report and return the exit code: 0 if every check passed, otherwise 1."""
    checks = run_checks(render_s)
    typer.echo(report(checks))
    return 0 if all(check.ok for check in checks) else 1


def _check_packages() -> Iterator[Check]:
    """Check this package, and each package that it, or one of its extras, needs.

    What only other extras need is not looked at. Versions are compared, nothing is imported.
    """
    try:
        requirements = metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        remedy = f"run `make setup`, or: {install_command('sim')}"
        yield Check(DISTRIBUTION, False, "not installed", remedy)
        return
    yield Check(DISTRIBUTION, True, metadata.version(DISTRIBUTION))

    needed = {}  # several extras may list the same package
    for text in requirements:
        requirement = Requirement(text)
        if requirement.name != DISTRIBUTION and _is_needed(requirement):
            needed[requirement.name] = requirement.specifier
    packages_by_module = metadata.packages_distributions()
    for name, specifier in needed.items():
        # A module may come from another package than the required one, such as a headless build.
        packages = packages_by_module.get(_MODULES.get(name, ""), [name])
        yield _check_package(name if name in packages else packages[0], specifier)


def _is_needed(requirement: Requirement) -> bool:
    """Return whether a requirement is one of all installations, or of the extras for playing."""
    marker = requirement.marker
    return marker is None or any(marker.evaluate({"extra": extra}) for extra in _EXTRAS)


def _check_package(name: str, specifier: SpecifierSet) -> Check:
    """Check that a package is installed in a version that `specifier`, such as ``>=2``, allows."""
    remedy = f"pip install '{name}{specifier}'"
    try:
        version = metadata.version(name)
    except metadata.PackageNotFoundError:
        return Check(name, False, f"not installed; needs {specifier}", remedy)
    if not specifier.contains(version, prereleases=True):
        return Check(name, False, f"{version}; needs {specifier}", remedy)
    return Check(name, True, version)


def _check_files() -> tuple[Check, ...]:
    """Check what lies outside the packages: files, folders and proxies."""
    return (
        _try("model files", lambda: str(look_for_model_files())),
        _try("temporary files", lambda: _write_to(tempfile.gettempdir())),
        _try("cache", lambda: _write_to(str(cache_folder() or "")), "all is made anew"),
        _try("shared memory", lambda: _write_to("/dev/shm"), "runs do without it"),  # noqa: S108
        _try("proxies", _name_proxies, "models elsewhere are out of reach"),
    )


def _try(name: str, find: Callable[[], str], without: str = "") -> Check:
    """Return the check of something by looking for it, such as the cache's folder.

    Args:
        name: of the check.
        find: returns what was found, empty if it is switched off; raises if it is missing or set to
            a wrong value.
        without: what happens without it, such as that runs are slower; empty if all runs need it.
            Then what is missing is a failure, else a remark.
    """
    can_do_without = bool(without)
    try:
        return Check(name, True, find() or "off")
    except OSError as error:
        found = error.strerror or str(error)
        if can_do_without:
            found += f": {without}"
        return Check(name, can_do_without, found, "let TMPDIR name a folder to write to")
    except RoboIRGError as error:
        # Such errors read "what is wrong; what to do".
        problem, _, remedy = str(error).partition("; ")
        # Only what is missing can be done without; a wrong value stops runs.
        is_missing = isinstance(error, MissingDependencyError)
        return Check(name, can_do_without and is_missing, problem, remedy)


def _check_opencv() -> Check:
    """Load OpenCV in a child process; its wheel needs two system libraries."""
    child = _run_python("-c", "import cv2")
    remedy = "run `make setup`, or: apt-get install libgl1 libglib2.0-0"
    return Check("OpenCV libraries", child.is_ok, "loaded" if child.is_ok else child.fault, remedy)


def _check_rendering(render_s: int = 0) -> tuple[Check, Check]:
    """Return two checks of the renderer: that there is a device, and that it draws.

    A child process draws, as a driver may crash or hang. It prints the device in its first line,
    and in the next ones what it drew; see `_draw_test_frame`.

    Args:
        render_s: seconds for which to go on drawing.
    """
    # "-u" for no buffer, because a line may be the last one before a crash.
    draw = ("-u", "-m", "roboirg.cli.doctor", "--frame", str(render_s))
    child = _run_python(*draw, limit_s=2 * (FRAME_TIMEOUT + render_s))
    lines = child.output.splitlines() or [""]
    device = lines.pop(0)
    remedy = f"{to_unset(DEVICE_VARIABLE, *DRIVER_VARIABLES)}{_RENDER_REMEDY}"

    found = "not tried: no device"
    if device:
        steps = lines[-1:]  # the last thing that was drawn, if anything was
        if not child.is_ok:
            steps.append(child.fault)
        found = ", then ".join(steps)
    name = f"{render_s} s of pictures" if render_s else "test frame"
    return (
        Check("render device", bool(device), device or child.fault, remedy),
        Check(name, child.is_ok, found, remedy),
    )


def _run_python(*arguments: str, limit_s: int = FRAME_TIMEOUT) -> _Child:
    """Run Python with some arguments in a child process; return its output and its fault.

    The fault says in words why it did not end well: too slow, a signal, or its last line of stderr.
    Nothing is raised.
    """
    try:
        child = subprocess.run(  # noqa: S603 - constant words in our own interpreter
            [sys.executable, *arguments],
            capture_output=True,
            text=True,
            errors="replace",
            check=False,
            timeout=limit_s,
        )
    except subprocess.TimeoutExpired as error:
        output = error.stdout or ""
        if isinstance(output, bytes):
            output = output.decode(errors="replace")
        return _Child(False, output, f"no end within {limit_s} s")
    code = child.returncode
    if code == -signal.SIGALRM:  # the alarm of `_draw_test_frame`
        return _Child(False, child.stdout, f"no picture within {FRAME_TIMEOUT} s")
    if code < 0:
        fault = f"the process crashed ({signal.strsignal(-code)})"
        return _Child(False, child.stdout, fault)
    errors = child.stderr.strip().splitlines() or [f"exit code {code}"]
    return _Child(code == 0, child.stdout, errors[-1])


def _check_memory() -> Check:
    """Check the memory of this machine, or what a container may use of it: enough for a worker."""
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    limit_file = Path("/sys/fs/cgroup/memory.max")  # a container's own limit
    if limit_file.is_file():
        limit = limit_file.read_text().strip()
        if limit.isdigit():
            memory = min(memory, int(limit))
    return Check(
        "memory",
        memory >= _MIN_MEMORY,
        f"{memory / _GIB:.1f} GiB",
        f"provide at least {_MIN_MEMORY // _GIB} GiB; each worker process takes about 0.5 GiB",
    )


def _write_to(folder: str) -> str:
    """Write a page of memory to a folder, and return it."""
    with tempfile.TemporaryFile(dir=folder) as file:
        file.write(bytes(mmap.PAGESIZE))
    return folder


def _name_proxies() -> str:
    """Return the proxies of addresses outside, in words, or ``"none"``.

    Models use them, and so does the fetch of model files.
    """
    used = {proxy_of(f"{scheme}://example.org").words for scheme in ("http", "https")}
    return ", ".join(sorted(used)).strip(" ,") or "none"


def _draw_test_frame(render_s: int) -> None:
    """Draw a scene of the benchmark; print the device, and then every second what was drawn.

    Args:
        render_s: seconds to go on drawing.

    Raises:
        RoboIRGError: no device can render, or there is no picture.
    """
    # Imported here because only the child process may load them.
    from roboirg.core.observations import PICTURE_SIZE
    from roboirg.simulation.rendering.render_device import describe_device, find_render_device
    from roboirg.simulation.world import World
    from roboirg.tasks.splits import get_episode

    device = describe_device(find_render_device())
    kind = "drawn by the processor" if device.is_software else "GPU"
    # The kernel ends this process if a picture hangs, even one that keeps Python's lock.
    signal.alarm(FRAME_TIMEOUT)
    sys.stdout.write(f"{device.name} at {device.alias} ({kind})\n")
    start = time.perf_counter()
    world = World(get_episode("PickXtimes", "test", 0).scene)
    pixels = world.picture("front").reshape(-1, 3)
    colors = len(set(map(bytes, pixels)))
    if colors < _FEWEST_COLORS:
        raise RenderDeviceError(f"the picture of a scene has only {colors} colors.")
    duration = time.perf_counter() - start
    sys.stdout.write(f"{PICTURE_SIZE} x {PICTURE_SIZE} pixels in {duration:.1f} s\n")
    _go_on_drawing(world, render_s)


def _go_on_drawing(world: World, seconds: int) -> None:
    """Draw a world that moves for some seconds; print after each how many pictures were drawn.

    The kernel ends this process if a single picture takes longer than `FRAME_TIMEOUT`.
    """
    from roboirg.core.observations import CAMERAS
    from roboirg.simulation.physics_settings import HOME_ACTION

    start = time.perf_counter()
    drawn = 0
    for second in range(1, seconds + 1):
        while time.perf_counter() < start + second:
            signal.alarm(FRAME_TIMEOUT)  # begins anew with every picture
            action = HOME_ACTION
            if drawn % _MOVE_EVERY == 0:
                action = HOME_ACTION * 0.9
            world.step(action)
            drawn += len(world.cameras.pictures(CAMERAS))
        sys.stdout.write(f"{drawn} pictures in {second} s\n")


def _main() -> int:
    """Run the doctor, or with ``--frame SECONDS`` its child that draws; return the exit code.

    0 if all is well, else 1.
    """
    if "--frame" not in sys.argv[1:]:
        return run_doctor()
    seconds = sys.argv[2:] or ["0"]
    try:
        _draw_test_frame(int(seconds[0]))
    except RoboIRGError as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(_main())
