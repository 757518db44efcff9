"""`roboirg fetch-models`: what it downloads, verifies and unpacks, with a small wheel."""

import hashlib
import re
import subprocess
import sys
import zipfile

import pytest

from roboirg import main as cli
from roboirg.core.errors import InvalidValueError, MissingDependencyError
from roboirg.simulation import model_fetch, model_files
from roboirg.simulation.model_fetch import WHEEL, fetch_model_files

METADATA = {
    "METADATA": "Metadata-Version: 2.1\nName: mani_skill\nVersion: 3.0.1\n",
    "WHEEL": "Wheel-Version: 1.0\nGenerator: test\nRoot-Is-Purelib: true\nTag: py3-none-any\n",
    "RECORD": "",
    "licenses/LICENSE": "a license",
    "licenses/LICENSE-3RD-PARTY": "others",
}


@pytest.fixture
def wheel(tmp_path, monkeypatch):
    """A wheel with small files in place of the models, whose hashes are expected."""
    contents = {name: name.encode() * 50 for name in model_files.MODEL_FILES}
    path = tmp_path / "index" / WHEEL
    path.parent.mkdir()
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in contents.items():
            archive.writestr(f"mani_skill/{name}", content)
        archive.writestr("mani_skill/__init__.py", "raise RuntimeError")
        for name, text in METADATA.items():
            archive.writestr(f"mani_skill-3.0.1.dist-info/{name}", text)
    digest = hashlib.sha256()
    for name, content in contents.items():
        digest.update(name.encode() + hashlib.sha256(content).digest())
    monkeypatch.setattr(model_files, "_SHA256", digest.hexdigest())
    monkeypatch.setattr(model_fetch, "WHEEL_SHA256", hashlib.sha256(path.read_bytes()).hexdigest())
    return path


@pytest.fixture
def folder(tmp_path, monkeypatch):
    path = tmp_path / "models"
    monkeypatch.setenv(model_files.FOLDER_VARIABLE, str(path))
    return path


def files_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


ALL_FILES = sorted([*model_files.MODEL_FILES, "LICENSE", "LICENSE-3RD-PARTY"])


def test_models_are_unpacked_from_a_local_wheel_and_not_again(wheel, folder):
    """A wheel is a package file of pip; this one holds small files in place of the models."""
    said = []
    assert fetch_model_files(wheel, said.append) == folder
    assert files_in(folder) == ALL_FILES

    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    wheel.unlink()
    assert fetch_model_files(None, said.append) == folder
    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    assert said == []


def test_missing_and_damaged_files_are_fetched_again(wheel, folder):
    fetch_model_files(wheel, print)
    (folder / model_files.MODEL_FILES[3]).unlink()
    (folder / model_files.MODEL_FILES[5]).write_text("damaged")
    with pytest.raises(MissingDependencyError, match=r"is missing in .*; run: roboirg fetch-model"):
        model_files.look_for_model_files()

    fetch_model_files(wheel, print)
    assert files_in(folder) == ALL_FILES

    (folder / model_files.MODEL_FILES[5]).write_text("damaged")
    with pytest.raises(MissingDependencyError, match=r"not those of ManiSkill 3\.0\.1"):
        model_files.look_for_model_files()


def test_a_wheel_with_another_hash_is_refused(wheel, folder):
    wheel.write_bytes(wheel.read_bytes() + b"more")
    for path in (wheel, wheel.parent, folder / "nowhere"):
        with pytest.raises(InvalidValueError, match=re.escape(f"'{path}' is not ")):
            fetch_model_files(path, print)
    assert not folder.exists()


def test_a_model_folder_that_is_a_file_is_reported_by_name(wheel, folder):
    folder.write_text("a file")
    with pytest.raises(InvalidValueError, match=f"{folder}.*ROBOIRG_MODEL_FILES names another"):
        fetch_model_files(wheel, print)


def test_models_are_downloaded_by_pip_with_the_user_s_configuration(
    wheel, folder, monkeypatch, capsys
):
    monkeypatch.setenv("PIP_NO_INDEX", "1")
    monkeypatch.setenv("PIP_FIND_LINKS", str(folder))
    monkeypatch.setattr(sys, "argv", ["roboirg", "fetch-models"])
    with pytest.raises(SystemExit, match="2"):
        cli.main()
    out, err = capsys.readouterr()
    assert (out, err.count("\n")) == ("", 2), err
    assert "pip could not download mani_skill-3.0.1" in err
    assert "--wheel" in err

    monkeypatch.setenv("PIP_FIND_LINKS", str(wheel.parent))
    with pytest.raises(SystemExit) as left:
        cli.main()
    assert not left.value.code
    assert capsys.readouterr().out == f"{folder}\n"
    assert files_in(folder) == ALL_FILES

    (folder / model_files.MODEL_FILES[0]).unlink()
    monkeypatch.setattr(model_fetch, "WHEEL_SHA256", "0" * 64)
    with pytest.raises(MissingDependencyError, match="is not PyPI's"):
        fetch_model_files(None, print)
    assert WHEEL not in files_in(folder)


def test_without_pip_the_models_are_downloaded_from_a_fixed_url(wheel, folder, monkeypatch):
    monkeypatch.setattr(model_fetch, "WHEEL_URL", wheel.as_uri())
    monkeypatch.setattr(model_fetch.importlib.util, "find_spec", lambda name: None)
    said = []
    assert fetch_model_files(None, said.append) == folder
    assert files_in(folder) == ALL_FILES
    assert len(said) == 1
    assert wheel.as_uri() in said[0]

    (folder / model_files.MODEL_FILES[0]).unlink()
    monkeypatch.setattr(model_fetch, "WHEEL_URL", f"{wheel.as_uri()}x")
    with pytest.raises(MissingDependencyError, match=r"Cannot download .*--wheel"):
        fetch_model_files(None, said.append)


def test_a_kill_while_unpacking_leaves_whole_files(wheel, folder):
    """The program dies before it writes the seventh file; six are whole, and the rest follows."""
    program = (
        "import os, sys; from pathlib import Path\n"
        "from roboirg.simulation import model_fetch, model_files\n"
        "write, left = model_fetch.write_atomically, [7]\n"
        "def write_or_die(path, content):\n"
        "    left[0] -= 1\n"
        "    write(path, content) if left[0] else os._exit(9)\n"
        "model_fetch.write_atomically = write_or_die\n"
        "model_fetch.WHEEL_SHA256 = sys.argv[2]\n"
        "model_fetch.fetch_model_files(Path(sys.argv[1]), print)\n"
    )
    command = [sys.executable, "-c", program, wheel, model_fetch.WHEEL_SHA256]
    killed = subprocess.run(command, check=False)
    assert killed.returncode == 9
    for name in files_in(folder):
        assert (folder / name).read_bytes() == name.encode() * 50
    assert len(files_in(folder)) == 6  # it died at the seventh

    fetch_model_files(wheel, print)
    assert files_in(folder) == ALL_FILES
