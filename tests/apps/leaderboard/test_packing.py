"""Packed runs: the same files come out, and nothing else gets out of the folder."""

import json
import zipfile
from pathlib import Path

from roboirg.apps.leaderboard.packing import pack_run
from roboirg.records.packs import MANIFEST, opened_run
from roboirg.records.run_files import store_plan
from roboirg.records.store import read_records


def test_the_same_run_comes_out(run, tmp_path):
    (run / "secret.txt").write_text("not packed")
    store_plan(b"[]", run)  # the other one stays, as an earlier plan
    manifest = pack_run(run, tmp_path / "a.zip")
    assert (manifest.records, manifest.policies) == (2, ("oracle", "random"))
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert json.loads(archive.read(MANIFEST)) == manifest.model_dump(mode="json")

    with opened_run(tmp_path / "a.zip") as folder:
        assert read_records(folder) == read_records(run)
        kept = {path.suffix for path in folder.rglob("*") if path.is_file()}
        assert kept == {".jsonl", ".json", ".npz"}
    assert not folder.exists()
    with opened_run(tmp_path / "a.zip", ()) as folder:
        assert {path.name for path in folder.iterdir()} == {"records.jsonl", "plan.json", "plans"}
        assert read_records(folder) == read_records(run)


def test_the_same_run_gives_the_same_bytes(run, tmp_path, monkeypatch):
    """On another disk, too, which lists files in another order."""
    found = Path.rglob
    for name, order in (("a.zip", 1), ("b.zip", -1)):
        monkeypatch.setattr(Path, "rglob", lambda *own, by=order: sorted(found(*own))[::by])
        pack_run(run, tmp_path / name, videos=True)

    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    with opened_run(tmp_path / "a.zip") as folder:
        assert (folder / "videos").is_dir()
