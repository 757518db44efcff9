"""Private episodes: drawn by a salt, which is written nowhere and which no policy's process has."""

from __future__ import annotations

import itertools
import os
import tempfile
import zipfile
from pathlib import Path

import pytest
from page_text import call
from run_fakes import FakePlay, fake_run

from roboirg.analysis.page.report import write_report
from roboirg.analysis.results.sources import Source
from roboirg.apps.leaderboard.packing import pack_run
from roboirg.core.errors import InvalidValueError, SceneRejectedError
from roboirg.records.merging import merge_runs
from roboirg.records.store import read_records
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.ray_cluster import RayCluster
from roboirg.runs.run.runner import run_plan
from roboirg.tasks import ALL, find_tasks
from roboirg.tasks.splits.private_splits import (
    SALT_VARIABLE,
    MissingSaltError,
    drawn_split,
    is_private,
    known_salt,
    private_seed,
    use_salt,
)
from roboirg.tasks.splits.splits import CYCLE, get_episode, make_episode, split_size

SALT = "a salt that nobody guesses"
OTHER = "another salt that nobody guesses"


@pytest.fixture(autouse=True)
def _no_salt(monkeypatch):
    monkeypatch.setenv(SALT_VARIABLE, "")  # so that what a test sets is undone


def seeds_of(episodes: int, task: str, split: str) -> list[int]:
    return [get_episode(task, split, index).seed for index in range(episodes)]


def test_each_salt_draws_episodes_of_its_own_that_are_in_no_public_split():
    """A salt is a secret text from which the scenes' seeds of a private split follow."""
    first = use_salt(SALT)
    assert is_private(first)
    seeds = {task: seeds_of(4, task, first) for task in find_tasks([ALL])}
    second = use_salt(OTHER)
    other_seeds = {task: seeds_of(4, task, second) for task in find_tasks([ALL])}

    found = [*itertools.chain(*seeds.values(), *other_seeds.values())]
    assert len(set(found)) == len(found)
    # No public seed is as large: 10,000,000 + 100 for each of a million episodes.
    assert min(found) > 1 << 40
    assert max(found) < 1 << 53  # a page's script can hold it

    use_salt(SALT)
    assert seeds_of(4, "PickXtimes", first) == seeds["PickXtimes"]
    assert split_size(first) == split_size("random")


def test_the_name_and_episodes_of_a_salt_never_change():
    assert use_salt("pinned-salt-0123") == "random@9be1761e24b2"
    seeds = seeds_of(2, "PickXtimes", "random@9be1761e24b2")
    assert seeds == [343211101013922, 319322239144157]


def test_private_episodes_repeat_the_difficulties_and_their_scenes_follow_from_their_seeds():
    split = use_salt(SALT)
    episodes = [get_episode("BinFill", split, index) for index in range(8)]

    assert [episode.difficulty for episode in episodes] == [*CYCLE, *CYCLE]
    for episode in episodes:
        made = make_episode("BinFill", episode.seed, episode.difficulty)
        assert (made.scene, made.goal) == (episode.scene, episode.goal)


def test_a_private_episode_takes_the_first_seed_for_which_a_scene_can_be_made():
    split = use_salt(SALT)
    task = "VideoPlaceOrder"
    rejected = 0

    for index in range(30):
        episode = get_episode(task, split, index)
        tried = 0
        while private_seed(task, split, index, tried) != episode.seed:
            seed = private_seed(task, split, index, tried)
            with pytest.raises(SceneRejectedError):
                make_episode(task, seed, episode.difficulty)
            tried += 1
        rejected += tried

    assert rejected > 0


@pytest.mark.parametrize("salt", ["", OTHER])
def test_a_private_split_is_refused_without_its_salt_or_with_another(salt):
    split = use_salt(SALT)
    os.environ[SALT_VARIABLE] = salt

    with pytest.raises(MissingSaltError, match=SALT_VARIABLE):
        get_episode("PickXtimes", split, 0)
    with pytest.raises(MissingSaltError, match=split):
        make_plan(["oracle"], split=split, episodes="1")


def test_a_short_salt_is_refused_without_being_printed():
    with pytest.raises(InvalidValueError, match="at least 12") as found:
        use_salt("short")

    assert "short" not in str(found.value)
    assert known_salt() is None


def test_a_known_salt_makes_the_random_split_private_and_no_other():
    assert drawn_split("random") == "random"

    split = use_salt(SALT)

    assert drawn_split("random") == split
    assert drawn_split("test") == "test"


def test_a_private_split_is_not_played_by_policies_that_share_the_worlds_process():
    split = use_salt(SALT)
    with pytest.raises(InvalidValueError, match="own"):
        make_plan(["oracle"], split=split, episodes="1", policy_process="shared")


def all_bytes_written_in(folder):
    """Return all that is written below a folder, with what is packed in archives."""
    found = []
    for path in sorted(folder.rglob("*")):
        if path.is_file():
            found += [path.name.encode(), path.read_bytes()]
        if zipfile.is_zipfile(path):
            with zipfile.ZipFile(path) as archive:
                found += [archive.read(name) for name in archive.namelist()]
    return b"\n".join(found)


def test_results_of_a_private_split_are_shown_merged_and_packed_without_its_salt(tmp_path):
    """Playing, verifying and showing scenes needs it, and no file that is written contains it."""
    split = use_salt(SALT)
    run = tmp_path / "run"
    run.mkdir()
    plan = make_plan(["oracle"], tasks="PickXtimes", split=split, episodes="3")
    fake_run(run, plan)

    assert "are private" not in write_report(Source(run)).read_text()

    os.environ[SALT_VARIABLE] = ""
    assert plan.drawable_jobs() == ()

    merge_runs([run], tmp_path / "merged")
    pack_run(run, tmp_path / "run.roboirg.zip")
    assert f"The episodes of {split} are private" in write_report(Source(run)).read_text()

    call("tables", run)
    for command in (("leaderboard", "verify", run), ("show", "PickXtimes", 0, "--split", split)):
        with pytest.raises(MissingSaltError):
            call(*command)
    assert SALT.encode() not in all_bytes_written_in(tmp_path)


def test_a_command_neither_prints_nor_writes_the_salt(tmp_path, monkeypatch):
    monkeypatch.setenv(SALT_VARIABLE, SALT)
    options = ["--policy", "random", "--split", "random", "--episodes", "1", "--dry-run"]

    assert SALT not in call("run", "--out", tmp_path / "run", *options)
    assert SALT.encode() not in all_bytes_written_in(tmp_path)


@pytest.mark.slow
def test_workers_of_a_cluster_get_the_salt_and_write_it_into_no_log(tmp_path):
    ray = pytest.importorskip("ray")
    with tempfile.TemporaryDirectory(prefix="ray-") as logs:  # short: sockets are in it
        ray.init(num_cpus=1, log_to_driver=False, include_dashboard=False, _temp_dir=logs)
        try:
            split = use_salt(SALT)
            run = tmp_path / "run"  # the cluster was started without it
            plan = make_plan(["oracle"], tasks="PickXtimes", split=split, episodes="1")
            run_plan(plan, run, FakePlay(), RayCluster(1))
        finally:
            ray.shutdown()
        assert {record.split for record in read_records(run)} == {split}
        written = all_bytes_written_in(Path(logs))
        assert b"raylet" in written
        assert SALT.encode() not in written
