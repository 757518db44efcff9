"""Packed runs: the same files come out, and nothing else gets out of the folder."""

import json
import zipfile
from pathlib import Path

import pytest

from roboirg.apps.leaderboard.packing import pack_run
from roboirg.records.packs import MANIFEST, opened_run
from roboirg.records.run_files import store_plan
from roboirg.records.store import read_records


def test_the_same_run_comes_out(run, tmp_path):
    """The run has records, a plan, actions, videos, logs, and here a file of somebody's.

    Without other wishes records, plans and actions are packed, in .jsonl, .json and .npz. The
    unpacked folder goes when it is left.
    """
    (run / "secret.txt").write_text("not packed")

    pack_run(run, tmp_path / "a.zip")

    with opened_run(tmp_path / "a.zip") as folder:
        assert read_records(folder) == read_records(run)
        kept = {path.suffix for path in folder.rglob("*") if path.is_file()}
        assert kept == {".jsonl", ".json", ".npz"}
    assert not folder.exists()


def test_a_pack_has_a_manifest_with_the_number_of_records_and_the_policies(run, tmp_path):
    """The run has one record of each of two policies; the manifest in the pack is what was
    returned.
    """
    manifest = pack_run(run, tmp_path / "a.zip")

    assert (manifest.records, manifest.policies) == (2, ("oracle", "random"))
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert json.loads(archive.read(MANIFEST)) == manifest.model_dump(mode="json")


def test_earlier_plans_of_a_run_are_packed(run, tmp_path):
    """To store another plan moves the first one to `plans`; both are in the pack."""
    store_plan(b"[]", run)  # the other one stays, as an earlier plan

    pack_run(run, tmp_path / "a.zip")

    with opened_run(tmp_path / "a.zip", ()) as folder:
        assert {path.name for path in folder.iterdir()} == {"records.jsonl", "plan.json", "plans"}


@pytest.fixture
def disk_that_lists_files_backward(monkeypatch):
    """Return what makes the disk list files in the opposite order from now on."""
    list_files = Path.rglob
    return lambda: monkeypatch.setattr(
        Path, "rglob", lambda *given: sorted(list_files(*given), reverse=True)
    )


def test_the_same_run_gives_the_same_bytes_on_another_disk(
    run, tmp_path, disk_that_lists_files_backward
):
    """Disks list files in different orders; a pack has one order of its own."""
    pack_run(run, tmp_path / "a.zip", videos=True)
    disk_that_lists_files_backward()
    pack_run(run, tmp_path / "b.zip", videos=True)

    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()


def test_videos_are_packed_if_asked_for(run, tmp_path):
    """Each of the run's two records has a video."""
    pack_run(run, tmp_path / "a.zip", videos=True)

    with opened_run(tmp_path / "a.zip") as folder:
        assert (folder / "videos").is_dir()
