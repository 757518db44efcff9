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


def test_from_a_checkout_it_names_the_folder(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    assert install_command("sim").endswith(f"install -e '{ROOT}[sim]'")

    monkeypatch.chdir(ROOT)
    assert install_command("sim").endswith("install -e '.[sim]'")


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
def test_elsewhere_it_names_what_pip_installed_from(monkeypatch, tmp_path, noted, wanted):
    kept = {"direct_url.json": noted and json.dumps(noted)}
    installed = SimpleNamespace(read_text=kept.__getitem__)
    monkeypatch.setattr(extras, "_CHECKOUT", tmp_path)
    monkeypatch.setattr(metadata, "distribution", lambda name: installed)

    assert install_command("vlm").endswith(f"install {wanted}")


def test_another_python_s_pip_is_not_named(monkeypatch, tmp_path):
    (tmp_path / "pip").write_text("#!/bin/sh\n")
    (tmp_path / "pip").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    assert install_command("sim").startswith(f"{sys.executable} -m pip install ")

    monkeypatch.setattr(sys, "executable", str(tmp_path / "python"))
    assert install_command("sim").startswith("pip install ")


def test_a_library_that_cannot_be_loaded_is_not_called_missing():
    with (
        pytest.raises(MissingDependencyError, match=r"is not installed .*nowhere_at_all"),
        extra_needed("This needs it", "sim"),
    ):
        import nowhere_at_all  # noqa: F401
    with (
        pytest.raises(
            MissingDependencyError, match=r"cannot be loaded .*libGL.*then roboirg doctor"
        ),
        extra_needed("This needs it", "sim"),
    ):
        raise ImportError("libGL.so.1: cannot open shared object file")
