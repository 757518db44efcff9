"""Private episodes: drawn by a salt, which is written nowhere and which no policy's process has."""

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


def seeds_of(episodes, task, split):
    return [get_episode(task, split, index).seed for index in range(episodes)]


def test_each_salt_draws_episodes_of_its_own_that_are_in_no_public_split():
    """Two salts, all tasks, four episodes each: no seed is drawn twice, and none is a public one.

    A salt is a secret text from which the seeds of a private split follow. Public seeds are below
    10,000,000 + 100 * 1,000,000, far less than 2^40.
    """
    seeds = []
    for salt in (SALT, OTHER):
        split = use_salt(salt)
        for task in find_tasks([ALL]):
            seeds += seeds_of(4, task, split)

    assert len(set(seeds)) == len(seeds)
    assert min(seeds) > 1 << 40
    assert max(seeds) < 1 << 53, "a page's script can hold it"


def test_a_salt_draws_the_same_episodes_again_after_another_was_used():
    """A salt is a secret text, from which the seeds of the scenes follow, here of four episodes."""
    split = use_salt(SALT)
    seeds = seeds_of(4, "PickXtimes", split)
    use_salt(OTHER)

    use_salt(SALT)

    assert is_private(split)
    assert seeds_of(4, "PickXtimes", split) == seeds


def test_a_private_split_has_as_many_episodes_as_the_random_one():
    """A salt makes a private split of its own, a drawn one as *random* is."""
    assert split_size(use_salt(SALT)) == split_size("random")


def test_the_name_and_episodes_of_a_salt_never_change():
    """A salt is a secret text from which the name and the seeds of a private split follow. These
    are stored values of this one: whoever has a salt can verify a run that was made with it before.
    """
    assert use_salt("pinned-salt-0123") == "random@9be1761e24b2"
    seeds = seeds_of(2, "PickXtimes", "random@9be1761e24b2")
    assert seeds == [343211101013922, 319322239144157]


def test_private_episodes_repeat_the_difficulties_and_their_scenes_follow_from_their_seeds():
    """Episodes have four difficulties in turn, as in public splits (CYCLE). Each of eight episodes
    has the scene and the goal that are made anew from its seed and difficulty."""
    split = use_salt(SALT)
    episodes = [get_episode("BinFill", split, index) for index in range(8)]

    assert [episode.difficulty for episode in episodes] == [*CYCLE, *CYCLE]
    for episode in episodes:
        made = make_episode("BinFill", episode.seed, episode.difficulty)
        assert (made.scene, made.goal) == (episode.scene, episode.goal)


def test_a_private_episode_takes_the_first_seed_for_which_a_scene_can_be_made():
    """A private episode has a sequence of seeds, of which `private_seed` gives one for each try.
    For all before the one that it has, its scene is rejected: there is no room for all things. Of
    30 episodes of this task some need a second try, so that something is tested."""
    split = use_salt(SALT)
    task = "VideoPlaceOrder"
    rejected_seeds = 0

    for index in range(30):
        episode = get_episode(task, split, index)
        tries = 0
        while private_seed(task, split, index, tries) != episode.seed:
            with pytest.raises(SceneRejectedError):
                make_episode(task, private_seed(task, split, index, tries), episode.difficulty)
            tries += 1
        rejected_seeds += tries

    assert rejected_seeds > 0


@pytest.mark.parametrize("salt", ["", OTHER])
def test_a_private_split_is_refused_without_its_salt_or_with_another(monkeypatch, salt):
    """A private split is made from one salt, SALT. Then none is set, or OTHER: neither an episode
    nor a plan of the split can be made. The messages name the variable for the salt and the split.
    """
    split = use_salt(SALT)

    monkeypatch.setenv(SALT_VARIABLE, salt)

    with pytest.raises(MissingSaltError, match=SALT_VARIABLE):
        get_episode("PickXtimes", split, 0)
    with pytest.raises(MissingSaltError, match=split):
        make_plan(["oracle"], split=split, episodes="1")


def test_a_short_salt_is_refused_without_being_printed():
    """A salt of five letters could be guessed; it needs 12. It is not kept either."""
    with pytest.raises(InvalidValueError, match="at least 12") as caught:
        use_salt("short")

    assert "short" not in str(caught.value)
    assert known_salt() is None


def test_a_known_salt_makes_the_random_split_private_and_no_other():
    """Without a salt the split *random* is public. Once it is set, that name means its private
    split; *test* stays what it is."""
    assert drawn_split("random") == "random"

    split = use_salt(SALT)

    assert drawn_split("random") == split
    assert drawn_split("test") == "test"


def test_a_private_split_is_not_played_by_policies_that_share_the_worlds_process():
    """In the process of the simulator a policy could read the salt. The message says that policies
    must have processes of their own."""
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


@pytest.fixture
def private_run(tmp_path, monkeypatch):
    """A run of three private episodes, and its plan; the salt is known no longer."""
    folder = tmp_path / "run"
    folder.mkdir()
    plan = make_plan(["oracle"], tasks="PickXtimes", split=use_salt(SALT), episodes="3")
    fake_run(folder, plan)
    monkeypatch.setenv(SALT_VARIABLE, "")
    return folder, plan


def test_results_of_a_private_split_are_shown_merged_and_packed_without_its_salt(
    private_run, tmp_path
):
    """The fixture has a run of private episodes, made with SALT, which is set no longer.

    All that needs no scene works: to merge and pack the run, its tables and its page. The page says
    that the episodes are private, as it cannot draw them. No file that was written, or is packed in
    one, has the salt in it.
    """
    run, plan = private_run

    merge_runs([run], tmp_path / "merged")
    pack_run(run, tmp_path / "run.roboirg.zip")
    call("tables", run)
    page = write_report(Source(run)).read_text()

    assert f"The episodes of {plan.split} are private" in page
    assert plan.drawable_jobs() == ()
    assert SALT.encode() not in all_bytes_written_in(tmp_path)


def test_the_page_of_a_private_split_says_nothing_of_it_if_the_salt_is_known(
    private_run, monkeypatch
):
    """The fixture has a run of private episodes, and the salt with which they were made is set."""
    run, _plan = private_run
    monkeypatch.setenv(SALT_VARIABLE, SALT)

    assert "are private" not in write_report(Source(run)).read_text()


def test_verifying_a_run_of_a_private_split_needs_its_salt(private_run):
    """The fixture has a run of private episodes. The salt is set no longer, so none can be made."""
    run, _plan = private_run

    with pytest.raises(MissingSaltError):
        call("leaderboard", "verify", run)


def test_showing_a_private_episode_needs_its_salt(private_run):
    """The fixture has a plan of private episodes. The salt is set no longer, so none is made."""
    _run, plan = private_run

    with pytest.raises(MissingSaltError):
        call("show", "PickXtimes", 0, "--split", plan.split)


def test_a_command_neither_prints_nor_writes_the_salt(tmp_path, monkeypatch):
    """The salt is set as a variable; the command plans an episode of its private split."""
    monkeypatch.setenv(SALT_VARIABLE, SALT)
    options = ["--policy", "random", "--split", "random", "--episodes", "1", "--dry-run"]

    printed = call("run", "--out", tmp_path / "run", *options)

    assert SALT not in printed
    assert SALT.encode() not in all_bytes_written_in(tmp_path)


@pytest.fixture
def logs_of_a_cluster():
    """A cluster of this machine was started; the folder with the logs of its processes."""
    ray = pytest.importorskip("ray")
    with tempfile.TemporaryDirectory(prefix="ray-") as logs:  # short: sockets are in it
        ray.init(num_cpus=1, log_to_driver=False, include_dashboard=False, _temp_dir=logs)
        yield Path(logs)
        ray.shutdown()


@pytest.mark.slow
def test_workers_of_a_cluster_get_the_salt_and_write_it_into_no_log(logs_of_a_cluster, tmp_path):
    """A salt is a secret text, SALT here, without which nobody can make the episodes of its split.

    The cluster was started before the salt was set, so its workers get it from the run; otherwise
    they could not play an episode. Their logs are there, with the name of one of Ray's programs,
    the raylet, in them, but without the salt.
    """
    split = use_salt(SALT)
    plan = make_plan(["oracle"], tasks="PickXtimes", split=split, episodes="1")

    run_plan(plan, tmp_path, FakePlay(), RayCluster(1))

    logs = all_bytes_written_in(logs_of_a_cluster)
    assert {record.split for record in read_records(tmp_path)} == {split}
    assert b"raylet" in logs
    assert SALT.encode() not in logs
