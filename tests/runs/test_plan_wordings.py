"""Runs in words from outside: plans, jobs, and a real run with worker processes."""

from pathlib import Path

import pytest
from msgspec.structs import replace

from roboirg.core.errors import InvalidValueError
from roboirg.core.versions import WORDS
from roboirg.language.scenarios import wording_store
from roboirg.language.scenarios.identity import words_of
from roboirg.records.record_codec import identity_key
from roboirg.runs.job_instruction import PreparedJob, instruct_job, other_versions
from roboirg.runs.plan.plan_file import read_plan_file
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.plan.stored_plans import read_plan, write_plan
from roboirg.runs.play.episode_record import begin_record

FILE_OF_SENTENCES = 'name = "test"\ntasks = ["PickXtimes"]\n' + "".join(
    f'[[literal]]\ntask = "PickXtimes"\nwhen = {{ color = "{color}", repeats = {number} }}\n'
    f'text = "pick up the {color} cube, {number} in all"\n'
    for color in ("red", "green", "blue")
    for number in range(1, 6)
)
FILE_WITH_A_TEMPLATE = (
    'name = "test"\ntasks = ["PickXtimes"]\n[commands]\nall = ["Do {color} {repeats}."]\n'
)


@pytest.fixture
def wording_file(tmp_path):
    path = tmp_path / "test.toml"
    path.write_text(FILE_OF_SENTENCES)
    return path


@pytest.fixture
def no_file_is_open(monkeypatch):
    """A process that has opened no file yet, like a worker's."""
    monkeypatch.setattr(wording_store, "_OPEN", {})


def plan_in_words_of(path, **options):
    chosen = read_plan_file("robomme") | {"tasks": "PickXtimes", "episodes": "2"}
    return make_plan(["random"], **(chosen | {"wordings": str(path)} | options))


def test_each_episode_in_words_of_a_file_has_their_digest_and_the_path(wording_file):
    """The plan has two episodes in three settings. All are in the words of the file named *test*;
    the digest begins with that name.
    """
    jobs = plan_in_words_of(wording_file).jobs()

    assert len(jobs) == 2 * 3
    (digest,) = {job.options.wordings for job in jobs}
    assert digest.startswith("test@")
    assert {job.wordings_file for job in jobs} == {str(wording_file)}


def test_episodes_in_other_words_are_other_episodes_and_the_file_may_be_moved(wording_file):
    """An episode is known by its key, which has the digest of the words and not the path."""
    job, *_ = plan_in_words_of(wording_file).jobs()

    in_our_words = job.with_options(wordings=None)
    moved = replace(job, wordings_file="elsewhere.toml")

    assert identity_key(in_our_words) != identity_key(job)
    assert identity_key(moved) == identity_key(job)


def test_episodes_in_the_benchmarks_words_have_neither_a_digest_nor_a_path():
    plan = make_plan(["random"], tasks="PickXtimes", settings="explicit", episodes="1")
    (job,) = plan.jobs()
    assert (job.options.wordings, job.wordings_file) == (None, None)


def test_a_stored_plan_is_read_although_its_file_of_words_is_gone(wording_file, tmp_path):
    """The plan has the digest of the words; only playing an episode needs the file."""
    plan = plan_in_words_of(wording_file)
    write_plan(plan, tmp_path)

    wording_file.unlink()

    stored = read_plan(tmp_path)
    assert stored == plan
    assert stored.jobs() == plan.jobs()


def test_a_plan_stores_the_absolute_path_of_its_file_of_words(wording_file, monkeypatch):
    monkeypatch.chdir(wording_file.parent)
    found = plan_in_words_of(Path("test.toml")).wordings
    assert found.file == str(wording_file)


@pytest.fixture
def job_of_a_worker(wording_file, monkeypatch):
    """A job in words of the file, in a process that has opened no file yet (`_OPEN` is empty)."""
    job, *_ = plan_in_words_of(wording_file).jobs()
    monkeypatch.setattr(wording_store, "_OPEN", {})
    return job


def test_a_worker_reads_the_file_of_words(job_of_a_worker):
    assert instruct_job(job_of_a_worker).text.startswith("pick up the ")


def test_a_worker_refuses_a_file_of_words_that_has_changed(job_of_a_worker, wording_file):
    wording_file.write_text(FILE_OF_SENTENCES.replace("pick up", "grab"))

    words = rf"but the episodes need {job_of_a_worker.options.wordings}; put"
    with pytest.raises(InvalidValueError, match=words):
        instruct_job(job_of_a_worker)


@pytest.mark.parametrize(
    ("content", "options", "words"),
    [
        (FILE_OF_SENTENCES, {"tasks": "StopCube"},
         r"StopCube; name tasks that it has: --tasks PickXtimes\.$"),
        (FILE_OF_SENTENCES.replace("repeats = 1 ", "repeats = 6 "), {"episodes": "20"},
         "has no sentence of PickXtimes for the goal"),
        ("tasks = ['PickXtimes']", {}, r"test.toml has the name '';"),
        ("name = 'a'\ntasks = ['PickXtime']", {}, r"test.toml: There is no task 'PickXtime'"),
    ],
    ids=["task", "goal", "name", "unknown task"],
)  # fmt: skip
def test_a_plan_is_refused_if_its_file_of_words_lacks_a_task_a_goal_or_a_name(
    wording_file, content, options, words
):
    """FILE_OF_SENTENCES has a sentence for each goal of PickXtimes: one of three colors, one to
    five times. It has no words for StopCube; without *once* a goal has no sentence; the last two
    files have no name, and a task that does not exist.
    """
    wording_file.write_text(content)

    with pytest.raises(InvalidValueError, match=words):
        plan_in_words_of(wording_file, **options)


def test_a_plan_is_refused_if_its_file_of_words_is_not_there(tmp_path):
    with pytest.raises(InvalidValueError, match=r"^The file '.*missing.toml' cannot be "):
        plan_in_words_of(tmp_path / "missing.toml")


@pytest.mark.usefixtures("no_file_is_open")
def test_an_episode_in_the_benchmarks_own_words_opens_no_file_of_words(wording_file):
    job = plan_in_words_of(wording_file).jobs()[0].with_options(wordings=None)

    missing = replace(job, wordings_file="missing.toml")

    assert instruct_job(missing) == instruct_job(job)


@pytest.fixture
def record_in_words_of_file(wording_file):
    """A record of an episode in words of a file with a template; it has a digest of them."""
    wording_file.write_text(FILE_WITH_A_TEMPLATE)
    job, *_ = plan_in_words_of(wording_file).jobs()
    return begin_record(PreparedJob(job))


@pytest.fixture
def record_with_a_wrong_digest(record_in_words_of_file):
    """The same record with the digest of the benchmark's own words, which the file has not."""
    ours = words_of("PickXtimes", record_in_words_of_file.pool)
    return replace(record_in_words_of_file, words=ours)


@pytest.mark.usefixtures("no_file_is_open")
def test_a_record_in_the_words_of_its_file_is_of_no_other_version(record_in_words_of_file):
    """A record has a digest of the words it was made with, and the path of their file."""
    assert not other_versions(record_in_words_of_file)


@pytest.mark.usefixtures("no_file_is_open")
def test_a_record_in_other_words_than_those_of_its_file_is_reported(record_with_a_wrong_digest):
    """A record has a digest of the words it was made with, and the path of their file."""
    assert [mismatch.what for mismatch in other_versions(record_with_a_wrong_digest)] == [WORDS]


@pytest.mark.parametrize(
    "change",
    [
        Path.unlink,
        lambda file: file.write_text(FILE_WITH_A_TEMPLATE.replace("Do", "Move")),
    ],
    ids=["gone", "changed"],
)
def test_words_of_a_record_are_not_compared_if_its_file_is_gone_or_has_changed(
    change, record_with_a_wrong_digest, wording_file, monkeypatch
):
    """The digest of the record is wrong, which is found only by reading the file. (Processes keep
    files that they have read in `_OPEN`, which is emptied here.) A report can be made without. A
    file that now says *Move* in place of *Do* may be another one.
    """
    monkeypatch.setattr(wording_store, "_OPEN", {})

    change(wording_file)

    assert not other_versions(record_with_a_wrong_digest)
