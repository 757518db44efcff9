"""Who is asked what: Latin squares, places, practice, checks."""

from collections import Counter, defaultdict
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as some

from roboirg.apps.people.listening_study import (
    PEOPLE,
    ListeningStudy,
    balanced_square,
    read_listening_study,
    write_listening_study,
)
from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.plan.plan_maker import make_plan


@given(some.integers(1, 12))
def test_squares_are_balanced(count):
    square = balanced_square(count)
    every = list(range(count))
    assert all(sorted(row) == every for row in square)
    for column in zip(*square[:count], strict=True):
        assert sorted(column) == every
    follows = Counter(pair for row in square for pair in pairwise(row))
    assert len(follows) == count * (count - 1)
    assert len(set(follows.values())) <= 1


def study_of(people=10, tasks="PickXtimes,StopCube,VideoRepick", **options):
    plan = make_plan([f"{PEOPLE}=oracle"], tasks=tasks, episodes="5", **options)
    return ListeningStudy(plan=plan.model_copy(update={"policies": (PEOPLE,)}), people=people)


def test_every_person_sees_every_episode_once_and_all_settings():
    study = study_of().checked()
    for place in range(10):
        items = [one.job for one in study.questions(place) if one.kind == "item"]
        assert len({(job.task, job.episode) for job in items}) == len(items) == 15
        # Five settings of PickXtimes; four of the two others, ten questions.
        counts = Counter(job.setting for job in items if job.task != "PickXtimes")
        assert max(counts.values()) - min(counts.values()) <= 1
        assert set(Counter(job.setting for job in items if job.task == "PickXtimes").values()) == {
            1
        }
        assert {job.policy for job in items} == {PEOPLE}


def test_people_in_a_row_are_one_seed():
    study = study_of(people=20).checked()
    seen = defaultdict(list)
    for place in range(20):
        for one in study.questions(place):
            if one.kind == "item":
                seen[one.job.task, one.job.episode].append((one.job.setting, one.job.policy_seed))
    for (task, _), pairs in seen.items():
        settings = 5 if task == "PickXtimes" else 4
        assert len(set(pairs)) == 20
        for seed in range(20 // settings):
            block = pairs[seed * settings : (seed + 1) * settings]
            assert len({setting for setting, _ in block}) == settings
            assert {number for _, number in block} == {seed}


def test_practice_comes_first_and_checks_are_spread():
    study = study_of().checked()
    kinds = [one.kind for one in study.questions(0)]
    assert kinds[:3] == ["practice"] * 3
    checks = [place for place, kind in enumerate(kinds) if kind == "check"]
    assert len(checks) == 2
    assert kinds[-1] == "item"
    asked = study.questions(0)
    others = [one.job for one in asked if one.kind != "item"]
    assert {job.split for job in others} == {"train"}
    assert {job.setting for job in others} == {"explicit"}
    assert len({(job.task, job.episode) for job in others}) == len(others)


def test_more_checks_than_questions_are_all_asked():
    study = study_of().model_copy(update={"checks": 40}).checked()
    kinds = Counter(one.kind for one in study.questions(3))
    assert kinds == {"practice": 3, "item": 15, "check": 40}


def test_a_study_is_read_as_it_was_written(tmp_path):
    study = study_of(delivery="turns").checked()
    write_listening_study(study, tmp_path / "study")
    assert read_listening_study(tmp_path / "study") == study
    write_listening_study(study, tmp_path / "study")
    with pytest.raises(InvalidValueError, match="other questions"):
        write_listening_study(study_of(people=3), tmp_path / "study")
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    with pytest.raises(InvalidValueError, match="not an empty folder"):
        write_listening_study(study, tmp_path / "full")
    with pytest.raises(InvalidValueError, match="roboirg listen plan"):
        read_listening_study(tmp_path)


@pytest.mark.parametrize(
    "change",
    [{"people": 0}, {"practice": -1}, {"checks": 100}, {"frames_every": 0}, {"consent": " \n"}],
)
def test_impossible_studies_are_refused(change):
    with pytest.raises(InvalidValueError):
        study_of().model_copy(update=change).checked()


def test_a_study_has_one_form_and_no_training_episodes():
    for options in ({"forms": "implicit,resolved"}, {"split": "train"}, {"stages": "1,5;1-5"}):
        with pytest.raises(InvalidValueError):
            study_of(**options).checked()
