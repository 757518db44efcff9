"""The interpreter names what it does not understand, and then returns no goals."""

import re
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from language_variants import TASKS, first_episodes

from roboirg.core.episode import Goal
from roboirg.language import instruct
from roboirg.language.settings import plain_settings, settings_of
from roboirg.reader import interpret
from roboirg.reader.tokens import FILLERS, split_sentences
from roboirg.reader.vocabulary import is_known
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode

PICK = get_episode("PickXtimes", "test", 2).scene
BIN = get_episode("BinFill", "test", 2).scene
STOP = get_episode("StopCube", "test", 2).scene
EPISODES = {task: tuple(first_episodes(task, "train", 2)) for task in TASKS}
TAKE = "Take the red cube and put it on the target once"


@pytest.mark.parametrize(
    ("text", "complaint", "words"),
    [
        ("Stack the red cube on the target.", 'verb "stack"', ["stack"]),
        ("Take the red cube and stack it on the target once.", 'verb "stack"', ["stack"]),
        ("Could you please stack the red cube?", 'verb "stack"', ["stack"]),
        ("I want you to balance the red cube.", 'verb "balance"', ["balance"]),
        (f"Stack the blue cube. {TAKE}.", 'verb "stack"', ["stack"]),
        (f"{TAKE}. Stack it.", 'verb "stack"', ["stack"]),
        ("Take the sphere and put it on the target once.", 'thing "sphere"', ["sphere"]),
        ("Take the big sphere.", 'thing "sphere"', ["big", "sphere"]),
        ("Take the orange cube.", 'color "orange"', ["orange"]),
        ("Take the orange one and put it on the target once.", 'color "orange"', ["orange"]),
        ("Take the wooden red cube.", 'word "wooden"', ["wooden"]),
        ("Take the cube behind the lamp.", 'place "behind the lamp"', ["lamp", "behind"]),
        ("Take the cube near the button.", 'place "near the button"', ["near"]),
        ("Take the cube left of the button.", 'place "left of the button"', ["left"]),
        ("Take the cube beside the button and put it on the target three times.",
         'place "beside the button"', ["beside"]),
        ("Take the cube next to the target.", 'place "next to the target"', ["next"]),
        ("Take the cube between the target and the button and put it on the target once.",
         'place "between the target"', ["between"]),
        ("Swing the red cube between the target and the button.", "between the target",
         ["between"]),
        ("Take the cube between both targets.", "between both targets", ["between"]),
        ("Take the cube under and put it on the target once.", 'place "under and"', ["under"]),
        ("Take the cube below, and put it on the target once.", 'place "below ,"', ["below"]),
        ("Take the cube that is under, and stop.", 'place "under ,"', ["under"]),
        ("Take the cube in the middle and put it on the target once.",
         'place "in the middle"', ["middle"]),
        ("Take the cube and put it on the plate.", 'place "on the plate"', ["plate"]),
        ("Take the red cube and put it on the target a dozen times.", "dozen", ["dozen"]),
        ("Take the red cube or the blue cube.", 'word "or"', ["or"]),
        ("If you like it, take the red cube.", 'word "if"', ["if"]),
        ("Take the red cube 3.5 times.", 'word "3.5"', ["3.5"]),
        ("Take fewer than three red cubes.", 'comparison "fewer than three"', ["fewer"]),
        ("Take the cube that is nearer to you.", 'word "nearer"', ["nearer"]),
        ("Take the cube further to your left.", 'comparison "further"', ["further"]),
        ("I rolled two and three. Take the red cube one time fewer than the total.",
         'comparison "total"', ["total"]),
        ("My number is the gap between seven and three. Take the red cube that many times.",
         'does not calculate: "my number is the gap between seven and three"', []),
        ("Take the red cube the 11th time.", 'word "11th"', ["11th"]),
        ("Take the röd cube.", 'word "röd"', ["röd"]),
        ("Nimm den roten Würfel.", "no command", ["nimm", "den", "roten", "würfel"]),
        ("Prends le cube rouge.", "no command", ["prends", "le", "rouge"]),
        ("拿起红色方块。", "no command", ["拿起红色方块"]),
        ("Hello there.", "no command", ["hello"]),
    ],
)  # fmt: skip
def test_unknown_words_are_named(text, complaint, words):
    found = interpret(text, PICK, "PickXtimes")
    assert not found.goals
    assert found.unknown_words == tuple(words)
    assert any(complaint in one for one in found.not_understood), found.not_understood


@pytest.mark.parametrize(
    ("text", "negation"),
    [
        ("Do not put the red cube into the bin.", "do not put"),
        ("Don't put two red cubes into the bin.", "do not put"),
        ("Don’t stack the red cubes.", "do not stack"),
        ("You must not put the red cube into the bin.", "must not put"),
        ("Never put the red cube into the bin.", "never put"),
        ("Avoid the red cube.", "avoid the red cube"),
        ("Avoid putting the red cube into the bin.", "avoid putting"),
        ("I do not want you to put the red cube into the bin.", "do not want"),
        ("I want you not to put the red cube into the bin.", "not to put"),
        ("Put the blue cube into the bin, but do not press the button.", "do not press"),
        ("Put the red cube not in the bin.", "not in"),
        ("Put the blue cube, not the red one, into the bin.", "not the red one"),
        ("Stop putting red cubes into the bin.", "stop putting"),
        ("Put -2 red cubes into the bin.", "minus 2"),
        ("Put minus two red cubes into the bin.", "minus two"),
        ("Put the red cube into the bin. No!", "no"),
        ("Put no red cubes into the bin.", "no red cubes"),
        ("Put nothing into the bin.", "nothing into"),
        ("Put neither cube into the bin.", "neither cube"),
        ("Put all cubes but the red ones into the bin.", "all cubes but the red ones"),
        ("Put the blue cube instead of the red cube into the bin.", "instead of the red cube"),
        ("Put a blue cube into the bin without the red cube.", "without the red cube"),
        ("Do not put the red cube into the bin. I like blue. Put it into the bin.", "do not put"),
        ("Put the blue cube into the bin. Do not put the red cube into it.", "do not put"),
    ],
)
def test_negations_are_named_and_license_no_goal(text, negation):
    found = interpret(text, BIN, "BinFill")
    assert not found.goals
    assert f'does not understand the negation "{negation}"' in found.not_understood


@pytest.mark.parametrize(
    "text",
    [
        f"Do not forget to {TAKE}, please.",
        f"Don't worry. {TAKE}.",
        f"Could you please {TAKE}?",
        f"You should {TAKE}.",
        f"Okay, do {TAKE} kindly.",
        f"I did not sleep well. Never mind the blue cube. {TAKE}.",
        f"I do not take sugar, thank you. {TAKE}.",
        f"{TAKE}. Thank you, you are very kind.",
        f"{TAKE}. I like blue, but never mind that.",
        ("My house is red and blue. Take the one of these two that is not blue, and put it on the "
         "target once."),
    ],
)  # fmt: skip
def test_harmless_negations_and_remarks_change_nothing(text):
    assert interpret(text, PICK, "PickXtimes") == ((Goal.of(color="red", repeats=1),), (), ())


PAGE = Path(__file__).parents[2] / "docs" / "interpreter.md"
ROWS = re.findall(r"^\| \*(.+?)\*.*? \| `(.+?)`", PAGE.read_text(), flags=re.MULTILINE)


@pytest.mark.parametrize(("text", "complaint"), ROWS)
def test_the_page_quotes_true_complaints(text, complaint):
    assert complaint in interpret(text, PICK, "PickXtimes").not_understood


def test_the_page_teaches_a_new_verb():
    assert len(ROWS) >= 8
    page = PAGE.with_name("teach-words.md").read_text()
    taught = re.search(r'"(Hoist .*)", "red", 2\)', page)
    assert interpret(taught[1], PICK, "PickXtimes").unknown_words == ("hoist",)


@pytest.mark.parametrize(
    ("text", "scene", "task", "complaint"),
    [
        ("Take the red cube and put it on the target nine times.", PICK, "PickXtimes",
         "the number is out of range: repeats can be 1 to 5"),
        ("Take the red cube and put it on the target 1000000000000 times.", PICK, "PickXtimes",
         "the number is out of range: repeats can be 1 to 5"),
        ("Take the red cube and put it on the target zero times.", PICK, "PickXtimes",
         "the number is out of range: repeats can be 1 to 5"),
        ("Press the button after the cube has passed zero times.", STOP, "StopCube",
         "the number is out of range: visit can be 2 to 5"),
        ("Stop the cube at the sixth visit.", STOP, "StopCube",
         "the number is out of range: visit can be 2 to 5"),
        ("Put 19 red cubes into the bin.", BIN, "BinFill",
         "no goal of the task has the amounts that the command names"),
        ("Take the yellow cube and put it on the target once.", PICK, "PickXtimes",
         "there is nothing yellow in the scene"),
        ("Take the cube sixth from the left and put it on the target once.", PICK, "PickXtimes",
         "there is nothing to handle at the place that the text names"),
        ("Take the yellow cube and put it on the target nine times.", PICK, "PickXtimes",
         "no goal of the task has the color that the command names"),
        (f"{TAKE}. No, the blue one.", PICK, "PickXtimes",
         'does not read what follows the command: "no , the blue one"'),
        (f"{TAKE}. 3 times.", PICK, "PickXtimes",
         'does not read what follows the command: "3 times"'),
    ],
)  # fmt: skip
def test_values_of_no_goal_and_words_behind_the_command_are_named(text, scene, task, complaint):
    found = interpret(text, scene, task)
    assert not found.goals
    assert complaint in found.not_understood


COMMANDS = [
    (task, episode, instruct(episode, setting))
    for task, episodes in EPISODES.items()
    for episode in episodes
    for setting in settings_of(get_task(task))
    if setting in plain_settings()
]


def is_unknown(word):
    return split_sentences(word) == ((word,),) and not is_known(word)


WORDS = st.one_of(
    st.sampled_from(sorted(FILLERS)),
    st.sampled_from(["sphere", "stack", "orange", "lamp", "thirtieth", "würfel", "11th", "x"]),
    st.text("abcdefghijklmnopqrstuvwxyzäß", min_size=1, max_size=9),
).filter(lambda word: word in FILLERS or is_unknown(word))


@settings(max_examples=50)
@given(st.sampled_from(COMMANDS), WORDS, st.data())
def test_a_word_more_is_harmless_or_named(case, word, data):
    task, episode, instruction = case
    *context, command = instruction.turns
    words = command.removesuffix(".").split()
    words.insert(data.draw(st.integers(0, len(words))), word)
    found = interpret(f"{' '.join([*context, *words])}.", episode.scene, task)
    if word in FILLERS:
        assert found == ((episode.goal,), (), ())
    else:
        assert word in found.unknown_words
        assert not found.goals
        assert any(f'"{word}"' in one or f" {word}" in one for one in found.not_understood)


@pytest.mark.parametrize(
    ("task", "text"),
    [
        ("SwingXtimes", "Swing the red cube between the left target and the right target twice."),
        ("SwingXtimes", "Move the red cube back and forth between both targets twice."),
        ("SwingXtimes", "Swing the red cube between the left and right targets twice."),
        ("SwingXtimes", ("Move the red cube to the top of the right target, then to the top of the "
         "left target, two times.")),
        ("VideoUnmask", "Lift the container that the red cube is hidden under."),
        ("VideoUnmask", "Lift the container the red cube is under, please."),
        ("VideoUnmask", "Lift the container under which the red cube is hidden."),
    ],
)  # fmt: skip
def test_what_is_between_or_under_may_be_a_way_or_a_hiding_place(task, text):
    found = interpret(text, get_episode(task, "test", 2).scene, task)
    assert found.not_understood == ()
    assert len(found.goals) == 1
