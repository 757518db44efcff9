"""The policies ``people:FOLDER`` and ``recorded:RUN``: specs, and what they play."""

import numpy as np
import pytest
from msgspec.structs import replace
from study_fakes import all_answers, answer_all, make_study

from roboirg.apps.people.answer_form import FormAnswer, answer_of, goal_of
from roboirg.apps.people.listening_session import ListeningSession
from roboirg.apps.people.people_run import answered_plan
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.play.rollout import EpisodeRunner
from roboirg.evaluation.records.record import Job
from roboirg.evaluation.records.record_codec import StoreError
from roboirg.evaluation.records.store import RecordStore, read_records
from roboirg.policies.by_name.loading import (
    is_privileged,
    load_policy_class,
    make_policy,
    policy_version,
)
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode


def test_specs_that_name_nothing_are_refused(tmp_path):
    for spec in ("people:", f"people:{tmp_path}", f"people:{tmp_path}?seed=1", "recorded:"):
        with pytest.raises(InvalidValueError):
            load_policy_class(spec)
    with pytest.raises(UnknownNameError, match="option of recorded"):
        load_policy_class(f"recorded:{tmp_path}?polcy=me")
    with pytest.raises(StoreError, match="no records"):
        load_policy_class(f"recorded:{tmp_path}")


def test_the_version_is_the_study_s(tmp_path, monkeypatch):
    make_study(tmp_path / "a", monkeypatch, tasks="StopCube", episodes="1", settings="explicit")
    make_study(tmp_path / "b", monkeypatch, tasks="StopCube", episodes="2", settings="explicit")
    versions = [policy_version(f"people:{tmp_path / one}") for one in "ab"]
    assert len(set(versions)) == 2
    assert all(one.startswith("study ") for one in versions)
    assert is_privileged(f"people:{tmp_path / 'a'}")


@pytest.mark.sim
def test_two_people_are_played_apart_and_again_by_the_log(tmp_path, monkeypatch):
    folder = tmp_path / "study"
    make_study(folder, monkeypatch, tasks="PickXtimes", episodes="0-1", settings="explicit",
               people=3, practice=0, checks=0)  # fmt: skip

    def right(question, _things):
        episode = get_episode(question.job.task, question.job.split, question.job.episode)
        return answer_of(episode, episode.goal)

    def wrong(question, things):
        episode = get_episode(question.job.task, question.job.split, question.job.episode)
        return next(one for one in all_answers(episode, things)
                    if one.values != right(question, things).values)  # fmt: skip

    session = ListeningSession(folder)
    answer_all(session, right)
    answer_all(session, wrong)
    session.close()
    jobs = answered_plan(folder).jobs()
    run = EpisodeRunner(tmp_path / "run")
    with RecordStore(tmp_path / "run") as store:
        for job in jobs:
            store.append(run(job))
    records = {(one.episode, one.policy_seed): one for one in read_records(tmp_path / "run")}
    told = [
        (records[key].outcome, records[key].policy_metadata["person"]) for key in sorted(records)
    ]
    assert told == [("success", "p01"), ("failure", "p02")] * 2
    # The third person has not answered.
    missing = run(replace(jobs[0], policy_seed=2))
    assert (missing.outcome, missing.error) == ("error", "policy")
    assert "No person of this policy seed has answered" in missing.cause

    spec = f"recorded:{tmp_path / 'run'}"
    job = Job(
        policy=spec,
        task="PickXtimes",
        split="test",
        episode=1,
        options=InstructionOptions("direct"),
    )
    again = EpisodeRunner(tmp_path / "again")(job)
    assert (again.outcome, again.steps) == ("success", records[1, 0].steps)
    other = run(replace(job, episode=7))
    assert (other.outcome, other.error) == ("error", "policy")
    assert "has no record of PickXtimes/test/7" in other.cause
    assert make_policy(f"{spec}?policy=nobody", 0)._records == []
    assert FormAnswer((), {}).category == "[[], {}]"


@pytest.mark.slow
@pytest.mark.sim
def test_random_answers_succeed_as_far_as_they_are_right(tmp_path, monkeypatch):
    folder = tmp_path / "study"
    make_study(folder, monkeypatch, tasks="PickXtimes,ButtonUnmask", episodes="8", people=1,
               settings="direct", practice=0, checks=0)  # fmt: skip
    rng, right = np.random.default_rng(2), {}

    def choose(question, things):
        episode = get_episode(question.job.task, question.job.split, question.job.episode)
        every = all_answers(episode, things)
        answer = every[int(rng.integers(len(every)))]
        goal = goal_of(episode, answer)
        # An episode ends with its success, so what an answer adds to the right things is not done.
        told = () if goal is None else get_task(episode.task).stages(episode.scene, goal)
        right[episode.task, episode.index] = told[: len(episode.stages)] == episode.stages
        return answer

    session = ListeningSession(folder)
    answer_all(session, choose)
    session.close()
    run = EpisodeRunner(tmp_path / "run")
    records = [run(job) for job in answered_plan(folder).jobs()]
    assert {(one.task, one.episode): one.outcome == "success" for one in records} == right
    assert {*right.values()} == {True, False}
