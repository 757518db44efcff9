"""The files of a run's folder: its plans, and what its records name.

`plan.json` is the newest plan; those of earlier commands are in ``plans/``.
"""

from __future__ import annotations

import os
import re
from pathlib import Path

from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.plain_text import printable
from roboirg.util.atomic_write import write_atomically
from roboirg.util.short_hash import short_hash

PLAN_FILE = "plan.json"
EARLIER_PLANS = "plans"

RELATIVE_PATH = r"^[A-Za-z0-9_][A-Za-z0-9_.-]*(/[A-Za-z0-9_][A-Za-z0-9_.-]*)*\Z"
"""A path in a record: relative, without ``..`` and hidden parts, in characters without meaning."""
MOST_PATH_LETTERS = 300
MOST_PLAN_BYTES = 64_000_000


class ForeignPathError(RoboIRGError):
    """A path is that of no file of the run's folder."""


def run_folder(path: str | Path) -> Path:
    """Return the path of a run's folder, which need not exist.

    Raises:
        InvalidValueError: it is no path, or its name is empty or has NUL.
    """
    is_path = isinstance(path, str | os.PathLike)
    if not is_path or not str(path).strip() or "\0" in str(path):
        raise InvalidValueError(f"The run's folder is {path!r}; it must be a path like runs/first.")
    return Path(path)


def run_file(folder: Path, name: str) -> Path:
    """Return the path of a file of a run, which need not exist; raise if it would be outside.

    A record may be a stranger's, so the names in it are not trusted.

    Args:
        folder: of the run.
        name: path relative to the folder, such as ``videos/a.mp4``.

    Raises:
        ForeignPathError: it is outside of the run's folder, perhaps by a symbolic link.
    """
    path = folder / name
    if not is_relative(name) or not _is_below(path, folder):
        shown = printable(name[:MOST_PATH_LETTERS])
        raise ForeignPathError(
            f"{shown!r} is not a file below {folder}: its name is longer than "
            f"{MOST_PATH_LETTERS}, has characters other than letters, digits, '_', '.' and '-', "
            "or a link leads elsewhere."
        )
    return path


def is_relative(name: str) -> bool:
    """Return whether a name can be that of a file below a folder: ``logs/a.txt``, not ``../x``."""
    return len(name) <= MOST_PATH_LETTERS and re.fullmatch(RELATIVE_PATH, name) is not None


def refuse_links(folder: Path) -> None:
    """Raise if something below a run's folder would let a run write elsewhere, or wait for ever.

    Plans are replaced and never written to, so they may share their content with other files.

    Raises:
        ForeignPathError: there is a symbolic link, a pipe or a device, or a file in the folder has
            another name, too (a hard link). The folder itself may be a link.
    """
    for path in folder.rglob("*"):  # nothing if there is no folder yet
        # Files below are replaced, and so is the plan: a hard link keeps what it has.
        is_appended_to = path.parent == folder and path.name != PLAN_FILE and path.is_file()
        if is_appended_to and path.stat().st_nlink > 1:
            raise ForeignPathError(
                f"{path} has another name elsewhere (a hard link), where a run would change it, "
                "too; put a copy in its place."
            )
        if path.exists() and not (path.is_file() or path.is_dir()):
            raise ForeignPathError(f"{path} is neither a file nor a folder; remove it.")
        if path.is_symlink():
            raise ForeignPathError(
                f"{path} is a symbolic link, and a run writes nothing through links; put a file or "
                "folder in its place, or make the folder of the run itself the link."
            )


def _is_below(path: Path, folder: Path) -> bool:
    """Return whether a path leads into a folder once all links in it are followed."""
    try:
        target = path.resolve()
        # From Python 3.13 on, links in a circle are no error, and stay what they are.
        return target.is_relative_to(folder.resolve()) and not target.is_symlink()
    except (OSError, RuntimeError):
        return False


def store_plan(content: bytes, folder: Path) -> None:
    """Write the newest plan of a run; a different one that was there moves to ``plans/``.

    Args:
        content: of the plan, JSON.
        folder: of the run.
    """
    newest = folder / PLAN_FILE
    if newest.is_file():
        earlier = newest.read_bytes()
        if earlier != content:
            keep_earlier_plan(earlier, folder)
    write_atomically(newest, content)


def keep_earlier_plan(content: bytes, folder: Path) -> None:
    """Write a plan that is not the newest."""
    path = folder / EARLIER_PLANS / f"{short_hash(content)}.json"
    if not path.exists():
        write_atomically(path, content)


def plan_names(folder: Path) -> list[str]:
    """Return the paths of all plans of a run, relative to its folder."""
    paths = [folder / PLAN_FILE, *earlier_plans(folder)]
    return [path.relative_to(folder).as_posix() for path in paths if path.is_file()]


def earlier_plans(folder: Path) -> list[Path]:
    """Return the files of plans that are not the newest, sorted by name."""
    return sorted((folder / EARLIER_PLANS).glob("*.json"))
