"""The command that a sentence about a missing library names works where the package came from."""

import json
import sys
from importlib import metadata
from pathlib import Path
from types import SimpleNamespace

import pytest

from roboirg.core import extras
from roboirg.core.errors import MissingDependencyError
from roboirg.core.extras import extra_needed, install_command

ROOT = Path(__file__).parents[1]


@pytest.mark.parametrize(
    ("folder", "named"), [(ROOT, "."), (ROOT / "docs", ROOT)], ids=["there", "elsewhere"]
)
def test_from_a_checkout_the_install_command_names_its_folder(monkeypatch, folder, named):
    """A dot if that is the working directory."""
    monkeypatch.chdir(folder)

    assert install_command("sim").endswith(f"install -e '{named}[sim]'")


@pytest.mark.parametrize(
    ("noted", "wanted"),
    [
        (None, "'roboirgbench[vlm]'"),
        (
            {"url": "file:///a/b.whl", "archive_info": {}},
            "'roboirgbench[vlm] @ file:///a/b.whl'",
        ),
        (
            {"url": "https://x/r.git", "vcs_info": {"vcs": "git", "commit_id": "ab12"}},
            "'roboirgbench[vlm] @ git+https://x/r.git@ab12'",
        ),
    ],
)
def test_an_installed_package_is_installed_again_from_where_pip_got_it(
    monkeypatch, tmp_path, noted, wanted
):
    """pip notes in direct_url.json that it was a file or a repository; None is the registry."""
    kept = {"direct_url.json": noted and json.dumps(noted)}
    installed = SimpleNamespace(read_text=kept.__getitem__)
    monkeypatch.setattr(extras, "_CHECKOUT", tmp_path)
    monkeypatch.setattr(metadata, "distribution", lambda name: installed)

    assert install_command("vlm").endswith(f"install {wanted}")


def test_the_install_command_calls_pip_by_its_python_if_the_pip_on_the_path_is_anothers(
    monkeypatch, tmp_path
):
    (tmp_path / "pip").write_text("#!/bin/sh\n")
    (tmp_path / "pip").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert install_command("sim").startswith(f"{sys.executable} -m pip install ")

    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    assert install_command("sim").startswith("pip install ")


def test_a_library_that_is_missing_is_said_not_to_be_installed():
    with (
        pytest.raises(MissingDependencyError, match=r"is not installed .*nowhere_at_all"),
        extra_needed("This needs it", "sim"),
    ):
        import nowhere_at_all  # noqa: F401


def test_a_library_that_is_installed_but_cannot_be_loaded_is_not_called_missing():
    """As OpenCV without the system's libGL; then `roboirg doctor` helps, not pip."""
    reason = r"cannot be loaded .*libGL.*then roboirg doctor"
    with (
        pytest.raises(MissingDependencyError, match=reason),
        extra_needed("This needs it", "sim"),
    ):
        raise ImportError("libGL.so.1: cannot open shared object file")
