"""Words are identified by a digest of what is said, and not by how the file is written."""

from __future__ import annotations

import pytest

from roboirg.language import LANGUAGE_VERSION, instruct
from roboirg.language.instruction_row import row
from roboirg.language.scenarios import identity
from roboirg.language.scenarios.identity import language_label, words_of
from roboirg.language.scenarios.scenario import General
from roboirg.language.scenarios.scenario_file import general, read_task_scenarios
from roboirg.tasks.splits.splits import get_episode

WORDS_FILE = """
tasks = ["PickXtimes"]

[commands.all]
train = ["Pick up {color} {repeats}.", "Lift {color} {repeats}."]
test = ["Take {color} {repeats}."]

[stated.all]
color = "the {color} cube"
repeats = "{repeats:times}"

[[scenario]]
frame = "near"
pool = "train"
setting = "spatial"
introduction = "Look {place:spot}."
say.color = ["<it color: it>", "<one color: the one I mentioned>"]

[[scenario]]
frame = "far"
pool = "train"
setting = "spatial"
introduction = "Look {place}."
say.color = ["<it color: it>"]

[[scenario]]
frame = "other"
pool = "test"
setting = "spatial"
introduction = "Look here, {place:spot}."
say.color = ["<it color: it>"]
"""
"""Two scenarios (templates of texts) for training, and one for tests."""


@pytest.fixture
def digest_of(monkeypatch):
    """A function that returns the digest of a file's words for PickXtimes, of one pool.

    Further names give the names of people and the remarks that all scenarios share.
    """

    def digest(text, pool="train", **shared):
        words = read_task_scenarios(text, "mine.toml")["PickXtimes"]
        fields = {"people": general().people, "distractors": general().distractors, **shared}
        monkeypatch.setattr(identity, "task_words", lambda *_: words)
        monkeypatch.setattr(identity, "general", lambda: General(**fields))
        return identity.words_digest.__wrapped__("PickXtimes", pool)

    return digest


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("[commands.all]", "# Commands.\n[commands.all]"),
        (
            'frame = "near"\npool = "train"\nsetting = "spatial"',
            'setting = "spatial"\npool = "train"\nframe = "near"',
        ),
        ('frame = "near"', 'frame = "near"\nneeds.tasks = ["PickXtimes"]'),
        (
            'tasks = ["PickXtimes"]',
            """tasks = ["PickXtimes", "SwingXtimes"]
stated.SwingXtimes.color = "that {color} cube"
commands.SwingXtimes.train = ["Swing {color} {repeats}."]""",
        ),
    ],
    ids=["comment", "order of fields", "needs the task anyway", "words of another task"],
)
def test_what_does_not_change_what_is_said_does_not_change_the_digest(digest_of, before, after):
    """Each case replaces `before` by `after` in the file above."""
    assert before in WORDS_FILE
    assert digest_of(WORDS_FILE.replace(before, after)) == digest_of(WORDS_FILE)


def test_the_order_of_scenarios_in_a_file_does_not_change_its_digest(digest_of):
    """A scenario is drawn by its name, not by its place."""
    head, *scenarios = WORDS_FILE.split("\n[[scenario]]\n")
    turned = "\n[[scenario]]\n".join([head, *reversed(scenarios)])

    assert turned != WORDS_FILE
    assert digest_of(turned) == digest_of(WORDS_FILE)


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ("Look {place}.", "Look there, {place}."),
        ("Lift {color}", "Hold {color}"),
        ("the {color} cube", "that {color} cube"),
        ("<one color: the one I mentioned>", "<that color: that cube>"),
        (
            '["Pick up {color} {repeats}.", "Lift {color} {repeats}."]',
            '["Lift {color} {repeats}.", "Pick up {color} {repeats}."]',
        ),
    ],
    ids=["introduction", "command", "name of a value", "pointer", "order of commands"],
)
def test_any_change_of_what_is_said_changes_the_digest(digest_of, before, after):
    """Commands are drawn by their place in the list, so another order gives other texts."""
    assert before in WORDS_FILE
    assert digest_of(WORDS_FILE.replace(before, after)) != digest_of(WORDS_FILE)


def test_other_people_or_other_remarks_change_the_digest(digest_of):
    """They are shared by all scenarios: `{person}` may be *Leo*, and a remark *Well.*"""
    people = {"he": ("Leo",), "she": ("Mia",)}
    remarks = {"train": ("Well.",), "test": general().distractors["test"]}

    usual = digest_of(WORDS_FILE)
    assert digest_of(WORDS_FILE, people=people) != usual
    assert digest_of(WORDS_FILE, distractors=remarks) != usual


def test_another_order_of_the_people_in_stories_changes_the_digest(digest_of):
    """Names are drawn by their place in the list, so another order gives other texts."""
    people = dict(reversed(general().people.items()))
    assert digest_of(WORDS_FILE, people=people) != digest_of(WORDS_FILE)


def test_words_of_the_pool_test_change_the_digest_of_that_pool_only(digest_of):
    """Two texts of the pool "test" are changed: a command and an introduction."""
    changed = WORDS_FILE.replace("Take {color}", "Grab {color}").replace("here,", "over there,")

    assert digest_of(changed, "test") != digest_of(WORDS_FILE, "test")
    assert digest_of(changed, "train") == digest_of(WORDS_FILE, "train")


def test_remarks_of_the_pool_test_leave_the_digest_of_the_pool_train(digest_of):
    """The remarks of training stay as they are."""
    remarks = {"train": general().distractors["train"], "test": ("Well.",)}
    assert digest_of(WORDS_FILE, "train", distractors=remarks) == digest_of(WORDS_FILE, "train")


def test_the_word_repeats_and_the_placeholder_repeats_have_different_digests(digest_of):
    """A user may write *repeats* as a word of the sentence."""
    word = WORDS_FILE.replace('"{repeats:times}"', '"repeats"')
    placeholder = WORDS_FILE.replace('"{repeats:times}"', '"{repeats}"')
    assert digest_of(word) != digest_of(placeholder)


def test_the_language_label_lists_the_words_of_each_task_after_the_version():
    """A task that does not exist, "Gone", stands for one without words."""
    digest = identity.words_digest("PickXtimes", "train")

    label = language_label(["PickXtimes", "Gone"], "train")

    assert label == f"{LANGUAGE_VERSION} PickXtimes/train@{digest} Gone/train@none"


@pytest.mark.parametrize("pool", ["train", "test"])
def test_an_instruction_and_its_exported_row_name_the_digest_of_their_words(pool):
    """`pool` is the chosen set of wordings; the episode is one of the test split."""
    episode = get_episode("PickXtimes", "test", 0)

    said = instruct(episode, "direct", wordings=pool)

    assert said.metadata["words"] == words_of("PickXtimes", pool)
    assert row(episode, said)["words_version"] == words_of("PickXtimes", pool)
