"""Only RoboMME's sentences may be named after it."""

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.language.scenarios.robomme_sentences import FINGERPRINTS, fingerprint
from roboirg.language.scenarios.wording_file import parse_wordings
from roboirg.tasks.splits.published_episodes import published_goals


def words(name="robomme", verb="Stop"):
    """Return the words of a file with a sentence for each visit."""
    text = f'name = "{name}"\ntasks = ["StopCube"]\n'
    for visit in range(1, 6):
        text += f'[[literal]]\ntask = "StopCube"\nwhen.visit = {visit}\n'
        text += f'text = "{verb} it {visit}."\n'
    return parse_wordings(text, "file")


def test_every_published_task_has_a_fingerprint():
    assert all(published_goals(task) for task in FINGERPRINTS)
    assert len(set(FINGERPRINTS.values())) == len(FINGERPRINTS) == 11


def test_other_sentences_are_refused_under_the_name():
    assert words("mine").name == "mine"
    with pytest.raises(InvalidValueError, match="not those of RoboMME's published evaluation"):
        words()


def test_the_fingerprint_is_of_what_is_said(monkeypatch):
    own = fingerprint("StopCube", words("mine").tasks["StopCube"].literals)
    monkeypatch.setitem(FINGERPRINTS, "StopCube", own)

    assert words().name == "robomme"
    with pytest.raises(InvalidValueError, match="StopCube"):
        words(verb="Halt")
