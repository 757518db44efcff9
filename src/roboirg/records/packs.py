"""Packed runs: one file that others can check, read like a run's folder.

A pack is a zip archive with the run's records, plan and actions, its logs and videos if wanted, and
``manifest.json``: versions, and the SHA-256 of every other file.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
import zipfile
from collections.abc import Collection, Iterator
from pathlib import Path, PurePosixPath

from pydantic import BaseModel, ConfigDict, NonNegativeInt

from roboirg.core.plain_text import printable
from roboirg.records.action_log import ACTION_FOLDER, UNREADABLE_ARCHIVE
from roboirg.records.episode_log import LOG_FOLDER
from roboirg.records.film import VIDEO_FOLDER
from roboirg.records.record_codec import StoreError
from roboirg.records.run_files import (
    EARLIER_PLANS,
    PLAN_FILE,
    is_relative,
)
from roboirg.records.store import RECORDS_FILE
from roboirg.util.regular_file import open_regular

PACK_SUFFIX = ".roboirg.zip"
MANIFEST = "manifest.json"
MEDIA_FOLDERS = (LOG_FOLDER, VIDEO_FOLDER)
PACKED_FOLDERS = (ACTION_FOLDER, *MEDIA_FOLDERS)
"""What a pack may hold in addition to records and plans."""
MOST_PACKED_BYTES = 20 << 30
"""Most bytes that are unpacked of a pack."""
_FORMAT = 1
"""Version of packs, which changes when an older roboirg could not read them."""
_MAX_MANIFEST_BYTES = 64 << 20
_MOST_SHOWN = 200
"""Characters of a name or a complaint in an error."""
_BLOCK = 1 << 20
"""Bytes that are unpacked at a time."""


class PackManifest(BaseModel):
    """What a pack says about itself.

    Attributes:
        format: version of packs.
        package_version: of the roboirg that packed the run.
        records: number of episodes.
        policies: names of the policies.
        files: SHA-256 of each file, in hexadecimal, by name.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: int = _FORMAT
    package_version: str
    records: NonNegativeInt
    policies: tuple[str, ...]
    files: dict[str, str]


@contextlib.contextmanager
def opened_run(path: Path, folders: Collection[str] = PACKED_FOLDERS) -> Iterator[Path]:
    """Yield the folder of a run: the path itself, or a pack (zip) that is unpacked temporarily.

    Args:
        path: of a folder or a pack.
        folders: of `PACKED_FOLDERS`, what is unpacked in addition to records and plans.

    Raises:
        StoreError: there is no such path, the file is no pack, or a file that is unpacked is not
            what the manifest says.
    """
    if path.is_dir():
        yield path
        return
    if not os.path.lexists(path):
        raise StoreError(
            f"There is no run at {path}; give the --out folder of a `roboirg run`, or a pack "
            f"(*{PACK_SUFFIX})."
        )
    with tempfile.TemporaryDirectory(prefix="roboirg-") as name:
        # Named like the pack, as messages about a file show its folder.
        folder = Path(name) / path.name
        folder.mkdir()
        try:
            with open_regular(path) as file, zipfile.ZipFile(file) as archive:
                _unpack(archive, path, folder, folders)
        except UNREADABLE_ARCHIVE as error:
            one_line = " ".join(str(error).split())
            words = printable(one_line)[:_MOST_SHOWN].rstrip(".")
            raise StoreError(f"{path} is not a packed run: {words}.") from error
        yield folder


def _manifest(archive: zipfile.ZipFile, path: Path) -> PackManifest:
    """Return the manifest of a pack, which lists the SHA-256 of its files.

    Args:
        archive: the pack.
        path: of the pack, for the error.

    Raises:
        StoreError: there is none, it cannot be read, or the pack is of another format.
    """
    try:
        if archive.getinfo(MANIFEST).file_size > _MAX_MANIFEST_BYTES:
            raise ValueError("it is too large")
        manifest = PackManifest.model_validate_json(archive.read(MANIFEST))
    except (KeyError, ValueError) as error:
        raise StoreError(f"{path} is not a packed run: its {MANIFEST} cannot be read.") from error
    if manifest.format != _FORMAT:
        raise StoreError(
            f"{path} is a pack of format {manifest.format}; this roboirg reads format {_FORMAT}."
        )
    return manifest


def _unpack(archive: zipfile.ZipFile, path: Path, folder: Path, folders: Collection[str]) -> None:
    """Unpack the wanted files of a pack, which may be a stranger's, so it is checked first.

    It must hold exactly the files of its manifest, only files of a run, and of wanted ones not too
    many bytes. Names are checked before anything is written under them, contents while they
    are written.

    Args:
        archive: the pack.
        path: of the pack, for errors.
        folder: where its files go.
        folders: those of `PACKED_FOLDERS` that are wanted, next to records and plans.

    Raises:
        StoreError: the pack is not what it should be.
    """
    digests = _manifest(archive, path).files
    entries = [entry for entry in archive.infolist() if entry.filename != MANIFEST]
    if sorted(entry.filename for entry in entries) != sorted(digests):
        raise StoreError(f"{path} does not hold exactly the files that its manifest names.")
    for name in digests:
        _check_name(name, path)
    unwanted = {*PACKED_FOLDERS} - {*folders}
    wanted = [entry for entry in entries if _top_folder(entry.filename) not in unwanted]
    if sum(entry.file_size for entry in wanted) > MOST_PACKED_BYTES:
        raise StoreError(f"{path} unpacks to more than {MOST_PACKED_BYTES >> 30} GiB.")
    for entry in wanted:
        _unpack_file(archive, entry, path, folder, digests[entry.filename])


def _unpack_file(
    archive: zipfile.ZipFile, entry: zipfile.ZipInfo, path: Path, folder: Path, expected: str
) -> None:
    """Unpack a file block by block, and raise if it is not the one of the manifest.

    Args:
        archive: the pack.
        entry: of the file.
        path: of the pack, for errors.
        folder: to unpack into.
        expected: SHA-256 of the file, as the manifest says.
    """
    target = folder / entry.filename
    target.parent.mkdir(parents=True, exist_ok=True)
    digest = hashlib.sha256()
    with archive.open(entry) as source, target.open("wb") as file:
        while block := source.read(_BLOCK):
            digest.update(block)
            file.write(block)
    if digest.hexdigest() != expected:
        raise StoreError(f"{entry.filename} in {path} is not the file that its manifest names.")


def _check_name(name: str, path: Path) -> None:
    """Raise unless a file in a pack has the name of a file of a run, such as ``logs/a.txt``.

    A name such as ``../x`` would be written outside of the folder.

    Args:
        name: path of the file in the pack.
        path: of the pack, for the error.
    """
    known_folders = (EARLIER_PLANS, *PACKED_FOLDERS)
    is_known = name in (RECORDS_FILE, PLAN_FILE) or _top_folder(name) in known_folders
    if not is_known or not is_relative(name):
        shown = printable(name[:_MOST_SHOWN])
        raise StoreError(f"{path} holds {shown!r}, which does not belong to a run.")


def _top_folder(name: str) -> str:
    """Return the first part of a path: ``logs`` for ``logs/a.txt``."""
    parts = PurePosixPath(name).parts
    return parts[0] if parts else ""
