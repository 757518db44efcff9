"""Agreement between people, and the tables of a study."""

import pytest

from roboirg.apps.people.listener_answers import AnswerUndone, PersonAnswered, PersonJoined
from roboirg.apps.people.listener_tables import (
    krippendorff_alpha,
    pairwise_agreement,
    person_table,
    setting_table,
)

# Krippendorff (2011), Computing Krippendorff's alpha-reliability, example C: four observers,
# twelve units, some of them missing; nominal alpha 0.743.
OBSERVED = (
    (1, 2, 3, 3, 2, 1, 4, 1, 2, None, None, None),
    (1, 2, 3, 3, 2, 2, 4, 1, 2, 5, None, 3),
    (None, 3, 3, 3, 2, 3, 4, 2, 2, 5, 1, None),
    (1, 2, 3, 3, 2, 4, 4, 1, 2, 5, 1, None),
)
UNITS = [[one for one in unit if one is not None] for unit in zip(*OBSERVED, strict=True)]


def test_alpha_is_that_of_the_published_example():
    assert krippendorff_alpha(UNITS) == pytest.approx(0.743, abs=5e-4)


def test_alpha_of_extremes():
    assert krippendorff_alpha([[1, 1], [2, 2], [3, 3, 3]]) == 1
    assert krippendorff_alpha([[1, 2]] * 8 + [[2, 1]] * 8) < 0
    assert krippendorff_alpha([]) is None
    assert krippendorff_alpha([[1], [2]]) is None
    assert krippendorff_alpha([[1, 1], [1, 1]]) is None


def test_pairs_of_equal_answers():
    assert pairwise_agreement([[1, 1], [1, 2], [3]]) == 0.5
    assert pairwise_agreement([[1, 1, 2]]) == pytest.approx(1 / 3)
    assert pairwise_agreement([[1]]) is None


def answered(person, number, setting="direct", kind="item", value=2, **fields):
    usual = {
        "task": "StopCube", "split": "test", "episode": number, "form": "implicit",
        "policy_seed": 0, "objects": (), "values": {"visit": value}, "goal": None, "at": "",
        "seconds": float(number),
    }  # fmt: skip
    return PersonAnswered(
        person=person, number=number, setting=setting, kind=kind, **{**usual, **fields}
    )


def events():
    yield from (PersonJoined(person=one, code=str(one), consent="", at="") for one in (1, 2))
    for person in (1, 2):
        yield answered(person, 1)
        yield answered(person, 2, value=1 + person)
        yield answered(person, 3, setting="explicit", hidden_s=4.0)
        yield answered(person, 4, setting="explicit", kind="check", split="train", value=9)
    yield answered(1, 5)
    yield AnswerUndone(person=1, number=5, at="")


def words(table):
    return {row.name: [entry.word for entry in row.entries] for row in table.rows}


def test_the_tables_of_a_study():
    table = words(setting_table(list(events())))
    assert list(table) == ["explicit", "direct", "all"]
    # People, answers, asked twice, agreement, alpha, seconds.
    assert table["direct"][:4] == ["2", "4", "2", "50.0"]
    assert table["explicit"][:6] == ["2", "2", "1", "100.0", "–", "3.0"]
    assert table["all"][:4] == ["2", "6", "3", "66.7"]
    people = words(person_table(list(events())))
    assert people == {
        "p01": ["3", "0 of 1", "2.0", "4", "1"],
        "p02": ["3", "0 of 1", "2.0", "4", "0"],
    }


def test_people_without_answers_are_in_the_table():
    joined = [PersonJoined(person=1, code="a", consent="", at="")]
    assert words(person_table(joined)) == {"p01": ["0", "0 of 0", "–", "0", "0"]}
    assert words(setting_table(joined))["all"][:4] == ["0", "0", "0", "–"]
