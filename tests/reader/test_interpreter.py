"""The reader is independent of what is said, accepts any text, and names what it does not know."""

import ast
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
each_task = st.sampled_from(tuple(EPISODES))
PICK_SCENE = get_episode("PickXtimes", "test", 2).scene
"""The scene has a blue, a red and a green cube."""


def test_the_interpreter_uses_neither_our_words_nor_their_declared_meaning():
    """It is evidence about our words only if it is independent of them.

    So its code has no attribute `words`, a task's file of words, and no `meaning`.
    """
    attributes = set()
    for path in Path(reader.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.Attribute):
                attributes.add(node.attr)

    assert attributes.isdisjoint({"words", "meaning"})


WORDS = """
the cube there former latter other than one two twice times take lift put it that red blue green
closest to second from left right far near corner container button you not pair , . 3 of color those
more fewer half as many camera never mind 99999999999999999999 ² é visit placement right before
after press first last neighbor whose number is less many into bin cubes swing stop drop moment
moved anything at its during over between target video used
"""
texts_of_command_words = st.lists(st.sampled_from(WORDS.split()), max_size=30).map(" ".join)


@settings(max_examples=80)
@given(task=each_task, text=st.one_of(st.text(max_size=200), texts_of_command_words))
def test_any_text_gives_one_goal_of_the_scene_or_a_complaint(task, text):
    """Random characters, and random words of commands: never an error, never both, never
    neither."""
    scene = EPISODES[task].scene

    found = interpret(text, scene, task)

    assert set(found.goals) <= set(get_task(task).goals(scene))
    has_one_goal = len(found.goals) == 1
    assert has_one_goal or found.not_understood
    assert not (has_one_goal and found.not_understood)


def test_a_place_nested_300_times_is_given_up_without_a_goal():
    """*The cube closest to the cube closest to …*: no error of too deep a recursion."""
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
    """*I like the red cube* asks for nothing, in no task."""
    for task, episode in EPISODES.items():
        found = interpret(text, episode.scene, task)

        assert found.goals == (), task
        assert "finds no command" in found.not_understood, task


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("Take the wooden cube.", ("wooden",)),
        ("Take the red cube 3.5 times.", ("3.5",)),
        ("Take the röd cube.", ("röd",)),
        ("Nimm den roten Würfel.", ("nimm", "den", "roten", "würfel")),
        ("拿起红色方块。", ("拿起红色方块",)),
    ],
)
def test_unknown_words_are_named(text, words):
    """In lower case, in the order of the text; numbers with a point count as unknown words."""
    found = interpret(text, PICK_SCENE, "PickXtimes")

    assert found.goals == ()
    assert found.unknown_words == words
    assert f'does not know the word "{words[0]}"' in found.not_understood


def is_unknown(word):
    """Return whether a text is one word that the interpreter does not know."""
    return split_sentences(word) == ((word,),) and not is_known(word)


unknown_words = st.one_of(
    st.sampled_from(["sphere", "stack", "orange", "lamp", "thirtieth", "würfel", "11th"]),
    st.text("abcdefghijklmnopqrstuvwxyzäß", min_size=2, max_size=9).filter(is_unknown),
)


def with_word_added(text, word, data, first=0):
    """Return a command with a word at any place from the `first` on, without its full stop."""
    words = text.removesuffix(".").split()
    words.insert(data.draw(st.integers(first, len(words))), word)
    return " ".join(words)


@settings(max_examples=30)
@given(task=each_task, filler=st.sampled_from(sorted(FILLERS)), data=st.data())
def test_a_filler_that_is_added_anywhere_to_a_command_changes_nothing(task, filler, data):
    """A filler is a word such as *please*."""
    episode = EPISODES[task]
    text = with_word_added(instruct(episode).text, filler, data)
    assert interpret(f"{text}.", episode.scene, task) == ((episode.goal,), (), ())


@settings(max_examples=40)
@given(task=each_task, word=unknown_words, data=st.data())
def test_an_unknown_word_that_is_added_anywhere_to_a_command_is_reported(task, word, data):
    """*Put the sphere red cube on the target* could mean anything."""
    episode = EPISODES[task]
    text = with_word_added(instruct(episode).text, word, data)

    found = interpret(f"{text}.", episode.scene, task)

    assert found.goals == ()
    assert word in found.unknown_words


words_that_change_a_command = st.sampled_from(
    ["not", "no", "except", "nine", "other", "fifth", "but", "or", "purple"]
)


@settings(max_examples=60)
@given(task=each_task, word=words_that_change_a_command, data=st.data())
def test_a_word_such_as_not_or_except_never_changes_the_goal_unnoticed(task, word, data):
    """The word is inserted anywhere into a command: the goal stays, or there is a complaint."""
    episode = EPISODES[task]
    text = with_word_added(instruct(episode).text, word, data, first=1)

    found = interpret(text, episode.scene, task)

    assert found.goals in ((), (episode.goal,)) or found.not_understood


COMPLAINTS = [
    ("Take the sphere.", 'does not know the word "sphere"'),
    ("Take the orange cube.", 'does not know the color "orange"'),
    ("Do not put the red cube on the target.", 'does not understand "not"'),
    ("Put it on the target twice.", 'does not read what "it" points back at'),
    ("Take the red cube or the blue cube.", 'does not know the word "or"'),
    ("Put the yellow cube on the target.", "there is nothing yellow in the scene"),
    ("Put a cube on the target.", "leaves color open: it can be blue or red or green"),
    ("I like the red cube.", "finds no command"),
]


@pytest.mark.parametrize(("text", "complaint"), COMPLAINTS)
def test_what_a_text_lacks_is_said_in_words_of_the_text(text, complaint):
    assert complaint in interpret(text, PICK_SCENE, "PickXtimes").not_understood


def test_the_words_that_the_documentation_teaches_are_unknown_before():
    """The page shows how a package teaches the interpreter *hoist* and *crimson*."""
    page = (Path(__file__).parents[2] / "docs" / "extend.md").read_text()
    (command,) = re.findall(r'interpret\("(Hoist .*?)"', page)
    assert interpret(command, PICK_SCENE, "PickXtimes").unknown_words == ("hoist", "crimson")
