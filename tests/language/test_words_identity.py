"""Words are identified by a digest of what is said, and not by how the file is written."""

from __future__ import annotations

import pytest

from roboirg.core.word_pools import POOLS, PoolName
from roboirg.language import LANGUAGE_VERSION, instruct
from roboirg.language.instruction_row import row
from roboirg.language.scenarios import identity
from roboirg.language.scenarios.identity import language_label, words_of
from roboirg.language.scenarios.scenario import General
from roboirg.language.scenarios.scenario_file import general, read_task_scenarios
from roboirg.tasks.splits.splits import get_episode

HEAD = """
tasks = ["PickXtimes"]
[commands.all]
train = ["Pick up {color} {repeats}.", "Lift {color} {repeats}."]
test = ["Take {color} {repeats}."]
[stated.all]
color = "the {color} cube"
repeats = "{repeats:times}"
"""
SPATIAL = """
[[scenario]]
frame = "%s"
pool = "train"
setting = "spatial"
introduction = "Look %s."
say.color = ["<it color: it>", "<one color: the one I mentioned>"]
"""
NEAR = SPATIAL % ("near", "{place:spot}")
FAR = SPATIAL % ("far", "{place}")
OTHER_TASK = (
    """
[commands.SwingXtimes]
train = ["Swing {color} {repeats}."]
[stated.SwingXtimes]
color = "that {color} cube"
"""
    + (SPATIAL + 'needs.tasks = ["SwingXtimes"]\n') % ("over there", "{place}")
)
OTHER_POOL = SPATIAL.replace('"train"', '"test"') % ("other", "here, {place:spot}")
FILE = HEAD + NEAR + FAR + OTHER_POOL


def digest(
    monkeypatch: pytest.MonkeyPatch, text: str, pool: PoolName = "train", **shared: object
) -> str:
    """Return the digest of a file's words, with other people or remarks of all tasks."""
    words = read_task_scenarios(text, "mine.toml")["PickXtimes"]
    fields = {"people": general().people, "distractors": general().distractors, **shared}
    monkeypatch.setattr(identity, "task_words", lambda *_: words)
    monkeypatch.setattr(identity, "general", lambda: General(**fields))  # type: ignore[arg-type]
    return identity.words_digest.__wrapped__("PickXtimes", pool)


def test_comments_and_the_order_of_scenarios_and_fields_are_no_other_words(monkeypatch):
    usual = digest(monkeypatch, FILE)
    lines = NEAR.strip().splitlines()
    turned = "\n".join([lines[0], *reversed(lines[1:])])

    for text in (
        FILE.replace("[commands.all]", "# Commands.\n[commands.all]"),
        HEAD + OTHER_POOL + FAR + NEAR,
        HEAD + turned + FAR + OTHER_POOL,
        FILE.replace('["PickXtimes"]', '["PickXtimes", "SwingXtimes"]', 1) + OTHER_TASK,
        FILE.replace("\nsetting", '\nneeds.tasks = ["PickXtimes"]\nsetting'),
    ):
        assert digest(monkeypatch, text) == usual


def test_each_change_of_what_is_said_is_other_words_of_its_pool_only(monkeypatch):
    found = {digest(monkeypatch, FILE)}
    changes = [
        ("Look {place}.", "Look there, {place}."),
        ("Lift {color}", "Hold {color}"),
        ("the {color} cube", "that {color} cube"),
        ("<one color: the one I mentioned>", "<that color: that cube>"),
        (HEAD.splitlines()[3], 'train = ["Lift {color} {repeats}.", "Pick up {color} {repeats}."]'),
    ]
    for before, after in changes:
        assert before in FILE
        found.add(digest(monkeypatch, FILE.replace(before, after)))
    found.add(digest(monkeypatch, FILE, people={"he": ("Leo",), "she": ("Mia",)}))
    remarks = general().distractors
    found.add(digest(monkeypatch, FILE, distractors={**remarks, "train": ("Well.",)}))

    assert len(found) == len(changes) + 3

    elsewhere = FILE.replace("here, ", "over there, ").replace("Take {color}", "Grab {color}")
    remarks = {**remarks, "test": ("Well.",)}
    assert digest(monkeypatch, elsewhere, distractors=remarks) == digest(monkeypatch, FILE)
    assert digest(monkeypatch, elsewhere, "test") != digest(monkeypatch, FILE, "test")


def test_the_order_in_which_people_are_drawn_is_part_of_the_words(monkeypatch):
    usual = digest(monkeypatch, FILE)
    people = dict(reversed(general().people.items()))
    assert digest(monkeypatch, FILE, people=people) != usual


def test_a_word_is_not_taken_for_the_slot_of_its_name(monkeypatch):
    word = FILE.replace('"{repeats:times}"', '"repeats"')
    slot = FILE.replace('"{repeats:times}"', '"{repeats}"')
    assert digest(monkeypatch, word) != digest(monkeypatch, slot)


def test_words_have_the_digest_of_their_task_and_pool():
    tasks = ("PickXtimes", "StopCube", "Gone")
    found = {words_of(task, pool) for task in tasks for pool in POOLS}
    assert len(found) == len(tasks) * len(POOLS)
    assert words_of("Gone", "test") == "Gone/test@none"

    digest = identity.words_digest("PickXtimes", "train")
    label = language_label(["PickXtimes", "Gone"], "train")
    assert label == f"{LANGUAGE_VERSION} PickXtimes/train@{digest} Gone/train@none"


@pytest.mark.parametrize("pool", POOLS)
def test_instructions_and_their_rows_say_which_words_they_have(pool):
    """In the pool that was chosen, if one was."""
    episode = get_episode("PickXtimes", "test", 0)
    words = words_of("PickXtimes", pool)

    said = instruct(episode, "direct", wordings=pool)

    assert (said.metadata["words"], row(episode, said)["words_version"]) == (words, words)
