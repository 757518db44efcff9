"""Only a file with RoboMME's sentences may have the name "robomme"; their hashes decide."""

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.language.scenarios.robomme_sentences import FINGERPRINTS, fingerprint
from roboirg.language.scenarios.wording_file import parse_wordings
from roboirg.tasks.splits.published_episodes import published_goals


def wording_file(name, verb="Stop"):
    """Return a file of that name with a sentence for each visit of StopCube: *Stop it 1.* …"""
    text = f'name = "{name}"\ntasks = ["StopCube"]\n'
    for visit in range(1, 6):
        text += f'[[literal]]\ntask = "StopCube"\nwhen.visit = {visit}\n'
        text += f'text = "{verb} it {visit}."\n'
    return parse_wordings(text, "file")


def test_eleven_tasks_have_fingerprints_of_robomme_s_sentences_all_different():
    """A fingerprint is a hash of a task's sentences for all its goals."""
    assert len(FINGERPRINTS) == 11
    assert len(set(FINGERPRINTS.values())) == 11


@pytest.mark.parametrize("task", FINGERPRINTS)
def test_a_task_with_robomme_s_sentences_has_published_goals(task):
    """RoboMME's evaluation has a sentence for each of them."""
    assert published_goals(task)


def test_a_file_that_calls_itself_robomme_with_other_sentences_is_refused():
    """Its results would look like those of RoboMME's own words."""
    with pytest.raises(InvalidValueError, match="not those of RoboMME's published evaluation"):
        wording_file("robomme")


def test_a_file_of_another_name_may_have_any_sentences():
    assert wording_file("mine").name == "mine"


@pytest.fixture
def stop_it_is_robomme_s(monkeypatch):
    """The five sentences *Stop it …* count as those of RoboMME."""
    sentences = wording_file("mine").tasks["StopCube"].literals
    monkeypatch.setitem(FINGERPRINTS, "StopCube", fingerprint("StopCube", sentences))


@pytest.mark.usefixtures("stop_it_is_robomme_s")
def test_the_fingerprint_of_sentences_does_not_depend_on_the_name_of_the_file():
    """It was taken of a file with the name "mine"."""
    assert wording_file("robomme").name == "robomme"


@pytest.mark.usefixtures("stop_it_is_robomme_s")
def test_one_other_verb_makes_sentences_those_of_someone_else():
    with pytest.raises(InvalidValueError, match="StopCube"):
        wording_file("robomme", verb="Halt")
