"""Only RoboMME's sentences may be named after it."""

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.language.scenarios.robomme_sentences import FINGERPRINTS, fingerprint
from roboirg.language.scenarios.wording_file import parse_wordings
from roboirg.tasks.splits.published_episodes import published_goals


def wording_file_with_five_sentences(name="robomme", verb="Stop"):
    """Return the words of a file with a sentence for each visit."""
    text = f'name = "{name}"\ntasks = ["StopCube"]\n'
    for visit in range(1, 6):
        text += f'[[literal]]\ntask = "StopCube"\nwhen.visit = {visit}\n'
        text += f'text = "{verb} it {visit}."\n'
    return parse_wordings(text, "file")


def test_each_of_the_eleven_tasks_has_its_own_fingerprint_of_robomme_s_sentences():
    """Only a file with RoboMME's sentences may call itself "robomme"; hashes decide."""
    assert all(published_goals(task) for task in FINGERPRINTS)
    assert len(set(FINGERPRINTS.values())) == len(FINGERPRINTS) == 11


def test_a_file_that_calls_itself_robomme_with_other_sentences_is_refused():
    assert wording_file_with_five_sentences("mine").name == "mine"
    with pytest.raises(InvalidValueError, match="not those of RoboMME's published evaluation"):
        wording_file_with_five_sentences()


def test_the_fingerprint_of_sentences_does_not_depend_on_the_name_of_the_file(monkeypatch):
    """With the hash of these sentences as the expected one, the name is allowed; then one verb
    changes."""
    own = fingerprint(
        "StopCube", wording_file_with_five_sentences("mine").tasks["StopCube"].literals
    )
    monkeypatch.setitem(FINGERPRINTS, "StopCube", own)

    assert wording_file_with_five_sentences().name == "robomme"
    with pytest.raises(InvalidValueError, match="StopCube"):
        wording_file_with_five_sentences(verb="Halt")
