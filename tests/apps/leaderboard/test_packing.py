"""Packed runs: the same files come out, and nothing else gets out of the folder."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path

import numpy as np
import pytest
from evaluation_fakes import fake_record

from roboirg.apps.leaderboard.packing import pack_run
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.records.action_log import ActionLog, write_actions
from roboirg.evaluation.records.packs import MANIFEST, opened_run
from roboirg.evaluation.records.record import Job
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.run_files import store_plan
from roboirg.evaluation.records.store import RecordStore, read_records


@pytest.fixture
def run(tmp_path: Path) -> Path:
    folder = tmp_path / "run"
    with RecordStore(folder) as store:
        for episode in range(3):
            rows = np.ones((episode + 1, 8))
            log = ActionLog("joint_angle", rows, np.zeros(1, np.int32), np.ones(2))
            job = Job(
                policy="random" if episode else "oracle",
                task="PickXtimes",
                split="test",
                episode=episode,
                options=InstructionOptions("direct"),
            )
            store.append(fake_record(job, started_at="", action_log=write_actions(log, folder)))
    (folder / "videos").mkdir()
    (folder / "videos" / "one.mp4").write_bytes(b"video")
    (folder / "secret.txt").write_text("not packed")
    (folder / "actions" / ".half.npz").write_text("left by a kill")
    store_plan(b"{}", folder)
    store_plan(b"[]", folder)  # the other one stays, as an earlier plan
    return folder


def test_the_same_run_comes_out(run: Path, tmp_path: Path) -> None:
    manifest = pack_run(run, tmp_path / "a.zip")
    assert (manifest.records, manifest.policies) == (3, ("oracle", "random"))
    with zipfile.ZipFile(tmp_path / "a.zip") as archive:
        assert json.loads(archive.read(MANIFEST)) == manifest.model_dump(mode="json")
    with opened_run(tmp_path / "a.zip") as folder:
        assert read_records(folder) == read_records(run)
        names = {path.name for path in folder.rglob("*") if path.is_file()}
        assert "secret.txt" not in names
        assert "one.mp4" not in names
        assert sum(name.endswith(".npz") for name in names) == 3
        assert sum(name.endswith(".json") for name in names) == 2
    assert not folder.exists()
    with opened_run(tmp_path / "a.zip", ()) as folder:
        assert {path.name for path in folder.iterdir()} == {"records.jsonl", "plan.json", "plans"}
        assert read_records(folder) == read_records(run)


def test_the_same_run_gives_the_same_bytes(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """On another disk, too, which lists files in another order."""
    found = Path.rglob
    for name, order in (("a.zip", 1), ("b.zip", -1)):
        monkeypatch.setattr(Path, "rglob", lambda *own, by=order: sorted(found(*own))[::by])
        pack_run(run, tmp_path / name, videos=True)
    assert (tmp_path / "a.zip").read_bytes() == (tmp_path / "b.zip").read_bytes()
    with opened_run(tmp_path / "a.zip") as folder:
        assert (folder / "videos" / "one.mp4").read_bytes() == b"video"


def rewritten(pack: Path, out: Path, change: dict[str, bytes | None]) -> Path:
    """Copy a pack with files changed, added or (None) removed."""
    with zipfile.ZipFile(pack) as source, zipfile.ZipFile(out, "w") as target:
        content = {name: source.read(name) for name in source.namelist()} | change
        for name, data in content.items():
            if data is not None:
                target.writestr(name, data)
    return out


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"records.jsonl": b"{}\n"}, "is not the file that its manifest names"),
        ({"more.txt": b"x"}, "exactly the files"),
        ({"records.jsonl": None}, "exactly the files"),
        ({MANIFEST: None}, "cannot be read"),
        ({MANIFEST: b"{}"}, "cannot be read"),
        ({MANIFEST: b"no json"}, "cannot be read"),
    ],
)
def test_a_changed_pack_is_refused(
    run: Path, tmp_path: Path, change: dict[str, bytes | None], words: str
) -> None:
    pack_run(run, tmp_path / "a.zip")
    forged = rewritten(tmp_path / "a.zip", tmp_path / "forged.zip", change)
    with pytest.raises(StoreError, match=words), opened_run(forged):
        pass
