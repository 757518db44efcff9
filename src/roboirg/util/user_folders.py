"""Folders of this user, also where there is no home: no HOME, and no entry of the user."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path
from typing import Literal

from roboirg.core.errors import InvalidValueError, MissingDependencyError

_NAME = "roboirgbench"


def user_folder(kind: Literal["cache", "data"], variable: str = "", *, below: str = "") -> Path:
    """Return the folder that a variable names, else the platform's, else a temporary one.

    Args:
        kind: of the platform's folder.
        variable: environment variable.
        below: folder inside, unless the variable names it whole.

    Raises:
        InvalidValueError: the variable begins with ``~``, but there is no home; or the temporary
            folder cannot be used.
        MissingDependencyError: the platform's folders are not known; the doctor runs without them.
    """
    chosen = os.environ.get(variable)
    if chosen:
        try:
            return Path(chosen).expanduser()
        except RuntimeError as error:
            raise InvalidValueError(
                f"{variable} is {chosen!r}, but there is no such home; write the whole path."
            ) from error
    folder = _platform_folder(kind)
    if not folder.is_absolute():  # there is no home
        folder = temporary_folder()
    return folder / below


def _platform_folder(kind: Literal["cache", "data"]) -> Path:
    """Return the folder of this user by the customs of the platform; ``~`` without a home.

    On Linux ``~/.cache/roboirgbench`` or ``~/.local/share/roboirgbench``; it need not exist.

    Raises:
        MissingDependencyError: platformdirs is not installed.
    """
    try:
        import platformdirs

        folder: Path = getattr(platformdirs, f"user_{kind}_path")(_NAME)
    except ImportError as error:
        raise MissingDependencyError(f"platformdirs is not installed ({error})") from error
    except RuntimeError:
        return Path("~")  # without a home, as older versions of platformdirs return it
    return folder


def temporary_folder() -> Path:
    """Return the folder of this user among the temporary files, made for this user alone.

    Raises:
        InvalidValueError: it belongs to another user, who could fill it with anything.
    """
    folder = Path(tempfile.gettempdir()) / f"{_NAME}-{os.getuid()}"
    folder.mkdir(mode=0o700, exist_ok=True)
    if folder.lstat().st_uid != os.getuid():
        raise InvalidValueError(f"The folder {folder} belongs to another user; set HOME.")
    return folder
