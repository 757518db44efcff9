"""What to run where a library of an extra is not installed."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Iterator
from pathlib import Path

from roboirg.core.errors import MissingDependencyError

DISTRIBUTION = "roboirgbench"
_CHECKOUT = Path(__file__).parents[3]


@contextlib.contextmanager
def extra_needed(sentence: str, extra: str) -> Iterator[None]:
    """Turn a failed import in the block into one sentence that says what to run.

    Args:
        sentence: what needs the library, for example ``"Figures need matplotlib"``.
        extra: the extra that brings the library.
    """
    try:
        yield
    except MissingDependencyError:  # is an ImportError that says it already
        raise
    except ModuleNotFoundError as error:
        raise MissingDependencyError(
            f"{sentence}, which is not installed ({error}); run: {install_command(extra)}"
        ) from error
    except ImportError as error:
        raise MissingDependencyError(
            f"{sentence}, which cannot be loaded ({error}); run: {install_command(extra)}, then "
            "roboirg doctor"
        ) from error


def install_command(extra: str) -> str:
    """Return the shell command that adds an extra, such as ``"report"``, to this installation.

    It names what the package was installed from: ``pip install -e '.[report]'`` in a checkout,
    ``pip install 'roboirgbench[report] @ git+https://…'`` from a repository, ``pip install
    'roboirgbench[report]'`` from an index.
    """
    if (_CHECKOUT / "pyproject.toml").is_file():
        folder = "." if Path.cwd() == _CHECKOUT else _CHECKOUT
        return f"{_pip()} install -e '{folder}[{extra}]'"
    requirement = f"{DISTRIBUTION}[{extra}]"
    origin = _origin()
    if origin:
        requirement += f" @ {origin}"
    return f"{_pip()} install '{requirement}'"


def _pip() -> str:
    """Return ``pip`` if the shell's belongs to this Python, otherwise the long form."""
    # Imported here, as in the next function: only a failed import needs them.
    import shlex
    import shutil

    found = shutil.which("pip")
    if found and Path(found).parent == Path(sys.executable).parent:
        return "pip"
    return f"{shlex.quote(sys.executable)} -m pip"


def _origin() -> str | None:
    """Return the address that pip noted when it did not install from an index (PEP 610).

    ``git+https://…@1a2b3c``, or a file's URL; None for an index, or if the package is not
    installed.
    """
    import json
    from importlib import metadata

    try:
        content = metadata.distribution(DISTRIBUTION).read_text("direct_url.json")
    except metadata.PackageNotFoundError:
        return None
    if not content:
        return None
    noted = json.loads(content)
    url: str | None = noted.get("url")
    repository = noted.get("vcs_info")
    if repository:
        return f"{repository['vcs']}+{url}@{repository['commit_id']}"
    return url
