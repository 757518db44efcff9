"""Runs in words from outside: plans, jobs, and a real run with worker processes."""

from __future__ import annotations

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
    """Other words make other episodes; the same words at another path do not."""
    plan = plan_in_words_of(wording_file)
    jobs = plan.jobs()
    assert len(jobs) == 2 * 3

    (identity,) = {job.options.wordings for job in jobs}
    assert identity.startswith("test@")
    assert {job.wordings_file for job in jobs} == {str(wording_file)}

    own = make_plan(["random"], tasks="PickXtimes", settings="explicit", episodes="2")
    assert {(job.options.wordings, job.wordings_file) for job in own.jobs()} == {(None, None)}

    # The same episodes in other words are other episodes; a file may be moved.
    moved = replace(jobs[0], wordings_file="elsewhere.toml")
    assert identity_key(moved) == identity_key(jobs[0]) != identity_key(own.jobs()[0])


def test_a_stored_plan_is_read_although_its_file_of_words_is_gone(wording_file, tmp_path):
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


@pytest.mark.usefixtures("no_file_is_open")
def test_a_worker_reads_the_file_of_words_and_refuses_it_if_it_has_changed(
    wording_file, monkeypatch
):
    job = plan_in_words_of(wording_file).jobs()[0]
    monkeypatch.setattr(wording_store, "_OPEN", {})
    assert instruct_job(job).text.startswith("pick up the ")

    monkeypatch.setattr(wording_store, "_OPEN", {})
    wording_file.write_text(FILE_OF_SENTENCES.replace("pick up", "grab"))
    with pytest.raises(
        InvalidValueError, match=rf"but the episodes need {job.options.wordings}; put"
    ):
        instruct_job(job)


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
)  # fmt: skip
def test_a_plan_is_refused_if_its_file_of_words_lacks_a_task_a_goal_or_a_name(
    wording_file, content, options, words
):
    wording_file.write_text(content)
    with pytest.raises(InvalidValueError, match=words):
        plan_in_words_of(wording_file, **options)
    with pytest.raises(InvalidValueError, match=r"^The file '.*missing.toml' cannot be "):
        plan_in_words_of(wording_file.with_name("missing.toml"), **options)


@pytest.mark.usefixtures("no_file_is_open")
def test_an_episode_in_the_benchmarks_own_words_opens_no_file_of_words(wording_file):
    job = plan_in_words_of(wording_file).jobs()[0].with_options(wordings=None)
    own = instruct_job(job)
    assert own.metadata["wordings"] is None

    missing = replace(job, wordings_file="missing.toml")
    assert instruct_job(missing) == own


@pytest.mark.usefixtures("no_file_is_open")
def test_words_of_a_record_are_compared_with_those_of_its_file_unless_that_is_gone_or_changed(
    wording_file, monkeypatch
):
    """A record has a digest of its words. A report can be made without the file."""
    wording_file.write_text(FILE_WITH_A_TEMPLATE)
    job = plan_in_words_of(wording_file).jobs()[0]
    record = begin_record(PreparedJob(job))
    assert record.words == words_of("PickXtimes", job.pool, wordings=job.options.wordings)
    assert record.words != words_of("PickXtimes", job.pool)

    other = replace(record, words=words_of("PickXtimes", job.pool))
    assert not other_versions(record)
    assert [mismatch.what for mismatch in other_versions(other)] == [WORDS]

    for text in (FILE_WITH_A_TEMPLATE.replace("Do", "Move"), None):
        monkeypatch.setattr(wording_store, "_OPEN", {})
        if text is None:
            wording_file.unlink()
        else:
            wording_file.write_text(text)
        assert not other_versions(record)
        assert not other_versions(other)
