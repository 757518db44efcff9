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

COMMANDS = """
tasks = ["PickXtimes"]
[commands.all]
train = ["Pick up {color} {repeats}.", "Lift {color} {repeats}."]
test = ["Take {color} {repeats}."]
[stated.all]
color = "the {color} cube"
repeats = "{repeats:times}"
"""
SCENARIO = """
[[scenario]]
frame = "%s"
pool = "train"
setting = "spatial"
introduction = "Look %s."
say.color = ["<it color: it>", "<one color: the one I mentioned>"]
"""
NEAR_SCENARIO = SCENARIO % ("near", "{place:spot}")
FAR_SCENARIO = SCENARIO % ("far", "{place}")
OTHER_TASK = (
    """
[commands.SwingXtimes]
train = ["Swing {color} {repeats}."]
[stated.SwingXtimes]
color = "that {color} cube"
"""
    + (SCENARIO + 'needs.tasks = ["SwingXtimes"]\n') % ("over there", "{place}")
)
TEST_POOL_SCENARIO = SCENARIO.replace('"train"', '"test"') % ("other", "here, {place:spot}")
WORDS_FILE = COMMANDS + NEAR_SCENARIO + FAR_SCENARIO + TEST_POOL_SCENARIO


def digest_of_words(
    monkeypatch: pytest.MonkeyPatch, text: str, pool: PoolName = "train", **shared: object
) -> str:
    """Return the digest of a file's words, with other people or remarks of all tasks."""
    words = read_task_scenarios(text, "mine.toml")["PickXtimes"]
    fields = {"people": general().people, "distractors": general().distractors, **shared}
    monkeypatch.setattr(identity, "task_words", lambda *_: words)
    monkeypatch.setattr(identity, "general", lambda: General(**fields))  # type: ignore[arg-type]
    return identity.words_digest.__wrapped__("PickXtimes", pool)


def test_comments_and_the_order_in_a_file_do_not_change_its_digest(monkeypatch):
    """Also without effect: words of another task, and a task that needs its own name."""
    usual = digest_of_words(monkeypatch, WORDS_FILE)
    lines = NEAR_SCENARIO.strip().splitlines()
    turned = "\n".join([lines[0], *reversed(lines[1:])])

    for text in (
        WORDS_FILE.replace("[commands.all]", "# Commands.\n[commands.all]"),
        COMMANDS + TEST_POOL_SCENARIO + FAR_SCENARIO + NEAR_SCENARIO,
        COMMANDS + turned + FAR_SCENARIO + TEST_POOL_SCENARIO,
        WORDS_FILE.replace('["PickXtimes"]', '["PickXtimes", "SwingXtimes"]', 1) + OTHER_TASK,
        WORDS_FILE.replace("\nsetting", '\nneeds.tasks = ["PickXtimes"]\nsetting'),
    ):
        assert digest_of_words(monkeypatch, text) == usual


def test_any_change_of_what_is_said_changes_the_digest_of_its_pool_only(monkeypatch):
    """A pool is a set of wordings, "train" or "test"; a file has words for both."""
    found = {digest_of_words(monkeypatch, WORDS_FILE)}
    changes = [
        ("Look {place}.", "Look there, {place}."),
        ("Lift {color}", "Hold {color}"),
        ("the {color} cube", "that {color} cube"),
        ("<one color: the one I mentioned>", "<that color: that cube>"),
        (
            COMMANDS.splitlines()[3],
            'train = ["Lift {color} {repeats}.", "Pick up {color} {repeats}."]',
        ),
    ]
    for before, after in changes:
        assert before in WORDS_FILE
        found.add(digest_of_words(monkeypatch, WORDS_FILE.replace(before, after)))
    found.add(digest_of_words(monkeypatch, WORDS_FILE, people={"he": ("Leo",), "she": ("Mia",)}))
    remarks = general().distractors
    found.add(
        digest_of_words(monkeypatch, WORDS_FILE, distractors={**remarks, "train": ("Well.",)})
    )

    assert len(found) == len(changes) + 3  # the file itself, other people and other remarks

    # Changes in the pool "test" leave the digest of the pool "train".
    elsewhere = WORDS_FILE.replace("here, ", "over there, ").replace("Take {color}", "Grab {color}")
    remarks = {**remarks, "test": ("Well.",)}
    assert digest_of_words(monkeypatch, elsewhere, distractors=remarks) == digest_of_words(
        monkeypatch, WORDS_FILE
    )
    assert digest_of_words(monkeypatch, elsewhere, "test") != digest_of_words(
        monkeypatch, WORDS_FILE, "test"
    )


def test_another_order_of_the_people_in_stories_changes_the_digest(monkeypatch):
    """Names are drawn by their place in the list, so another order gives other texts."""
    usual = digest_of_words(monkeypatch, WORDS_FILE)
    people = dict(reversed(general().people.items()))
    assert digest_of_words(monkeypatch, WORDS_FILE, people=people) != usual


def test_the_word_repeats_and_the_placeholder_repeats_have_different_digests(monkeypatch):
    word = WORDS_FILE.replace('"{repeats:times}"', '"repeats"')
    slot = WORDS_FILE.replace('"{repeats:times}"', '"{repeats}"')
    assert digest_of_words(monkeypatch, word) != digest_of_words(monkeypatch, slot)


def test_each_task_and_pool_has_a_digest_of_its_own_in_the_language_label():
    """A task without words has "none" in the place of the digest."""
    tasks = ("PickXtimes", "StopCube", "Gone")
    found = {words_of(task, pool) for task in tasks for pool in POOLS}
    assert len(found) == len(tasks) * len(POOLS)
    assert words_of("Gone", "test") == "Gone/test@none"

    digest = identity.words_digest("PickXtimes", "train")
    label = language_label(["PickXtimes", "Gone"], "train")
    assert label == f"{LANGUAGE_VERSION} PickXtimes/train@{digest} Gone/train@none"


@pytest.mark.parametrize("pool", POOLS)
def test_an_instruction_and_its_exported_row_name_the_digest_of_their_words(pool):
    """The digest is that of the pool of wordings that was chosen."""
    episode = get_episode("PickXtimes", "test", 0)
    words = words_of("PickXtimes", pool)

    said = instruct(episode, "direct", wordings=pool)

    assert (said.metadata["words"], row(episode, said)["words_version"]) == (words, words)
