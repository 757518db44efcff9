"""Only RoboMME's sentences may be named after it."""

import pytest
from roboirg.language.wordings.robomme_sentences import (
    FINGERPRINTS,
    check_robomme_name,
    fingerprint,
)
from roboirg.language.wordings.wording_file import parse_wordings, read_wordings

from roboirg.core.errors import InvalidValueError
from roboirg.tasks.splits.published_episodes import published_goals

TEXT = """name = "{name}"
[StopCube.phrases.visit]
1 = "the first time"
2 = "the second time"
3 = "the third time"
4 = "the fourth time"
5 = "the fifth time"
[[StopCube.commands]]
text = "Stop it {{visit}}."
"""


def test_every_published_task_has_a_fingerprint():
    assert all(published_goals(task) for task in FINGERPRINTS)
    assert len(set(FINGERPRINTS.values())) == len(FINGERPRINTS) == 11


def test_other_sentences_are_refused_under_the_name(tmp_path):
    file = tmp_path / "words.toml"
    file.write_text(TEXT.format(name="mine"))
    assert read_wordings(file).name == "mine"
    file.write_text(TEXT.format(name="robomme"))
    with pytest.raises(InvalidValueError, match="not those of RoboMME's published evaluation"):
        read_wordings(file)


def test_the_fingerprint_is_of_what_is_said(monkeypatch):
    words = parse_wordings(TEXT.format(name="robomme"), "file")
    own = fingerprint("StopCube", words.tasks["StopCube"])
    monkeypatch.setitem(FINGERPRINTS, "StopCube", own)
    check_robomme_name(words, "file")
    # How the file is written does not matter; a changed word does.
    again = parse_wordings(TEXT.replace("[StopCube.phrases", "\n[StopCube.phrases")
                           .format(name="robomme"), "file")  # fmt: skip
    check_robomme_name(again, "file")
    changed = parse_wordings(TEXT.format(name="robomme").replace("Stop it", "Halt it"), "file")
    with pytest.raises(InvalidValueError, match="StopCube"):
        check_robomme_name(changed, "file")
