"""The reader is independent of what is said, accepts any text, and names what it does not know."""

import ast
import itertools
import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboirg import reader
from roboirg.language import instruct
from roboirg.reader import interpret
from roboirg.reader.phrases import PlaceholderText
from roboirg.reader.things import read_things
from roboirg.reader.tokens import FILLERS, split_sentences
from roboirg.reader.vocabulary import is_known
from roboirg.tasks import every_task, get_task
from roboirg.tasks.splits import get_episode

EPISODES = {task: get_episode(task, "train", 3) for task in every_task()}
PICK_SCENE = get_episode("PickXtimes", "test", 2).scene


def test_the_interpreter_uses_neither_our_words_nor_their_declared_meaning():
    """It is evidence about our words only if it is independent of them."""
    trees = [ast.parse(path.read_text()) for path in Path(reader.__file__).parent.glob("*.py")]
    nodes = itertools.chain.from_iterable(map(ast.walk, trees))
    attributes = {node.attr for node in nodes if isinstance(node, ast.Attribute)}

    assert not attributes & {"words", "meaning"}


WORDS = (
    "the cube there former latter other than one two twice times take lift put it that red blue "
    "green closest to second from left right far near corner container button you not pair , . 3 "
    "of color those more fewer half as many camera never mind 99999999999999999999 ² é "
    "visit placement right before after press first last neighbor whose number is less many into "
    "bin cubes swing stop drop moment moved anything at its during over between target video used"
)


@settings(max_examples=80)
@given(
    st.sampled_from(tuple(EPISODES)),
    st.one_of(
        st.text(max_size=200),
        st.lists(st.sampled_from(WORDS.split(" ")), max_size=30).map(" ".join),
    ),
)
def test_any_text_gives_one_goal_or_a_complaint(task, text):
    """Random text and random words of commands: no error, and no goal that the scene lacks."""
    scene = EPISODES[task].scene
    found = interpret(text, scene, task)

    assert set(found.goals) <= set(get_task(task).goals(scene))
    assert bool(found.not_understood) == (len(found.goals) != 1)


def test_a_place_nested_300_times_is_given_up_without_a_goal():
    text = "Take the cube " + "closest to the cube " * 300 + "at the far left."
    assert interpret(text, PICK_SCENE, "PickXtimes").goals == ()


def test_the_same_container_over_it_still_means_the_one_shown_in_the_video():
    """*Over it* adds a place; it must not erase that *the same* refers to the video."""
    sentence = PlaceholderText("lift the same container over it")
    read_things(sentence)
    _, container = sentence.tokens()
    assert container.value.is_shown


@pytest.mark.parametrize("text", ["", "  ", "...", "\n", "?!", "I like the red cube."])
def test_text_without_a_command_gives_no_goal(text):
    for task, episode in EPISODES.items():
        found = interpret(text, episode.scene, task)
        assert not found.goals
        assert "finds no command" in found.not_understood


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Take the wooden cube.", ["wooden"]),
        ("Take the red cube 3.5 times.", ["3.5"]),
        ("Take the röd cube.", ["röd"]),
        ("Nimm den roten Würfel.", ["nimm", "den", "roten", "würfel"]),
        ("拿起红色方块。", ["拿起红色方块"]),
    ],
)
def test_unknown_words_are_named(text, words):
    found = interpret(text, PICK_SCENE, "PickXtimes")
    assert not found.goals
    assert found.unknown_words == tuple(words)
    for word in words:
        assert f'does not know the word "{word}"' in found.not_understood


def is_unknown(word):
    return split_sentences(word) == ((word,),) and not is_known(word)


HARMLESS_AND_UNKNOWN_WORDS = st.one_of(
    st.sampled_from(sorted(FILLERS)),
    st.sampled_from(["sphere", "stack", "orange", "lamp", "thirtieth", "würfel", "11th"]),
    st.text("abcdefghijklmnopqrstuvwxyzäß", min_size=2, max_size=9).filter(is_unknown),
)


@settings(max_examples=60)
@given(st.sampled_from(tuple(EPISODES)), HARMLESS_AND_UNKNOWN_WORDS, st.data())
def test_an_added_word_is_a_known_filler_or_is_reported_as_unknown(task, word, data):
    """A filler is a word such as *please*, which changes nothing."""
    episode = EPISODES[task]
    words = instruct(episode).text.removesuffix(".").split()
    words.insert(data.draw(st.integers(0, len(words))), word)

    found = interpret(f"{' '.join(words)}.", episode.scene, task)

    if word in FILLERS:
        assert found == ((episode.goal,), (), ())
    else:
        assert not found.goals
        assert word in found.unknown_words


CHANGING_WORDS = ["not", "no", "except", "nine", "other", "fifth", "but", "or", "purple"]


@settings(max_examples=60)
@given(st.sampled_from(tuple(EPISODES)), st.sampled_from(CHANGING_WORDS), st.data())
def test_a_word_such_as_not_or_except_never_changes_the_goal_unnoticed(task, word, data):
    """The word is inserted anywhere into a command: the goal stays, or there is a complaint."""
    episode = EPISODES[task]
    words = instruct(episode).text.removesuffix(".").split()
    words.insert(data.draw(st.integers(1, len(words))), word)

    found = interpret(" ".join(words), episode.scene, task)

    assert found.goals in ((), (episode.goal,)) or found.not_understood


DOCUMENTATION = Path(__file__).parents[2] / "docs" / "interpreter.md"
ROWS = re.findall(r"^\| \*(.+?)\*.*? \| `(.+?)`", DOCUMENTATION.read_text(), flags=re.MULTILINE)


@pytest.mark.parametrize(("text", "complaint"), ROWS)
def test_the_complaints_quoted_by_the_documentation_are_real(text, complaint):
    assert complaint in interpret(text, PICK_SCENE, "PickXtimes").not_understood


def test_the_verb_that_the_documentation_teaches_is_unknown_before():
    assert len(ROWS) >= 8

    page = DOCUMENTATION.with_name("teach-words.md").read_text()
    taught = re.search(r'"(Hoist .*)", \("red", 2\)', page)
    assert interpret(taught[1], PICK_SCENE, "PickXtimes").unknown_words == ("hoist",)
