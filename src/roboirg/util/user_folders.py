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
    try:
        if chosen:
            return Path(chosen).expanduser()
        import platformdirs

        found: Path = getattr(platformdirs, f"user_{kind}_path")(_NAME)
    except ImportError as error:
        raise MissingDependencyError(f"platformdirs is not installed ({error})") from error
    except RuntimeError as error:
        if chosen:
            raise InvalidValueError(
                f"{variable} is {chosen!r}, but there is no such home; write the whole path."
            ) from error
        found = Path("~")  # as older versions return it
    return (found if found.is_absolute() else temporary_folder()) / below


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
