"""Wording files: by hand, bad ones, their identity, and writing them."""

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from wording_stand_ins import train_episodes

from roboirg.core.episode import Goal
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct, instruct_with, interpret
from roboirg.language.export import row
from roboirg.language.validation.episode_checks import check_episode
from roboirg.language.wordings.worded_command import StatedPhrase, TaskWordings, WordedCommand
from roboirg.language.wordings.wording_file import parse_wordings, read_wordings
from roboirg.language.wordings.wording_store import find_wordings, open_wordings, register_wordings
from roboirg.language.wordings.wording_writer import wording_text

HAND = """\
name = "by-hand"
source = "A test."

[PickXtimes]
own = ["reasoning"]

[PickXtimes.phrases]
color = { red = "the red cube", green = "the green cube", blue = "the blue cube" }
repeats = { 2 = "twice", 3 = "three times", 4 = "four times", 5 = "five times" }

[[PickXtimes.commands]]
when = { repeats = 1 }
text = "Could you put {color} on the target, and press the button?"

[[PickXtimes.commands]]
text = "Could you put {color} on the target {repeats}, and press the button?"

[VideoUnmask]
phrases.colors = { red = "the container with [the red cube]" }

[[VideoUnmask.commands]]
text = "lift {colors.0}"
"""
UNMASK = '[VideoUnmask]\n[[VideoUnmask.commands]]\ntext = "lift {colors.0}"\n'


def write(folder: Path, text: str = HAND) -> Path:
    path = folder / "hand.toml"
    path.write_text(text)
    return path


def episode_with(task: str, **slots):
    """A training episode with such a goal."""
    return next(
        one
        for one in train_episodes(task, 0, 100)
        if slots.items() <= one.goal.as_mapping().items()
    )


def test_a_file_by_hand(tmp_path):
    identity = open_wordings(write(tmp_path))
    assert re.fullmatch("by-hand@[0-9a-f]{8}", identity)
    once = episode_with("PickXtimes", color="red", repeats=1)
    thrice = episode_with("PickXtimes", color="blue", repeats=3)
    assert instruct(once, wordings=identity).text == (
        "Could you put the red cube on the target, and press the button?"
    )
    said = instruct(thrice, wordings=identity)
    assert (
        said.text == "Could you put the blue cube on the target three times, and press the button?"
    )
    assert [(said.span(one), one.slot, one.value) for one in said.mentions] == [
        ("the blue cube", "color", "blue"),
        ("three times", "repeats", 3),
    ]
    direct = instruct(once, "direct", wordings=identity)
    assert direct.command == "Could you put it on the target that many times, and press the button?"
    assert interpret(direct.text, once.scene, "PickXtimes").goals == (once.goal,)
    hidden = instruct(episode_with("VideoUnmask", colors=("red",)), "direct", wordings=identity)
    assert hidden.command == "lift the container with it"


def test_the_example_in_the_docs_is_read_and_valid():
    page = (Path(__file__).parents[2] / "docs" / "language.md").read_text()
    (example,) = re.findall(r'```toml\n(name = "workshop".*?)```', page, re.DOTALL)
    identity = register_wordings(parse_wordings(example, "example"))
    for task in ("PickXtimes", "VideoUnmask"):
        for episode in train_episodes(task, 0, 12):
            assert not check_episode(episode, wordings=identity).failures


def test_metadata_and_export_name_the_wording_and_the_command(tmp_path):
    identity = open_wordings(write(tmp_path))
    episode = episode_with("PickXtimes", repeats=3)
    template = "Could you put {color} on the target {repeats}, and press the button?"
    for setting, command in (("explicit", template), ("direct", template), ("reasoning", "own")):
        said = instruct(episode, setting, wordings=identity)
        assert said.metadata["wordings"] == identity
        assert said.metadata["command"] == command
        exported = row(episode, said)
        assert (exported["wordings"], exported["command_template"]) == (identity, command)
    own = instruct(episode, "reasoning")
    assert own.text == instruct(episode, "reasoning", wordings=identity).text
    assert (own.metadata["wordings"], own.metadata["command"]) == (None, "own")


def test_a_goal_or_task_without_a_command_is_told(tmp_path):
    identity = open_wordings(write(tmp_path))
    blue = episode_with("VideoUnmask", colors=("blue",))
    with pytest.raises(InvalidValueError, match=r"no command of VideoUnmask .* colors.0 blue\.$"):
        instruct(blue, "direct", wordings=identity)
    with pytest.raises(InvalidValueError, match=r"have no commands of StopCube\.$"):
        instruct(episode_with("StopCube"), wordings=identity)


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("name = ", "is not valid TOML"),
        (UNMASK, "has the name None; it must begin with a line such as"),
        ('name = "a b"\n' + UNMASK, "has the name 'a b'"),
        ('name = "a"\nsource = 3\n' + UNMASK, "has the source 3; it must be a text"),
        ('name = "a"', "has no task; add one such as [PickXtimes]"),
        ('name = "a"\n[PickXTimes]', "Did you mean 'PickXtimes'?"),
        ('name = "a"\nStopCube = 3', "has 3 for the task; it must be a table"),
        ('name = "a"\n[StopCube]\nown = []', "needs [[TASK.commands]]"),
        ('name = "a"\n[StopCube]\nown = ["dirct"]\ncommands = [{}]', "Did you mean 'direct'?"),
        ('name = "a"\n[StopCube]\ncommand = 3', "Did you mean 'commands'?"),
        ('name = "a"\n[StopCube]\ncommands = [{}]', "has a command with the text None"),
        ('name = "a"\n' + UNMASK, "has no phrases for the field {colors.0}"),
        ('name = "a"\n' + UNMASK.replace("colors.0", "colour"), "'colour'; known: color, "),
        ('name = "a"\n' + UNMASK.replace("lift {", "lift {{"), "has a bracket that is no field"),
        (
            'name = "a"\n'
            + UNMASK.replace("lift", "{visit} {visit}")
            + "phrases.visit = { 2 = 'x' }",
            "has the field {visit} twice",
        ),
        ('name = "a"\n' + UNMASK + "when = { color = 1.5 }", "has the condition color = 1.5"),
        ('name = "a"\n' + UNMASK + "when = { shade = 1 }", "There is no key of when"),
        ('name = "a"\n' + UNMASK + "phrases.colors = 3", "has the phrases colors = 3"),
        (
            'name = "a"\n' + UNMASK + "phrases.colors = { red = 'a [b] [c]' }",
            "has the phrase 'a [b] [c]' for colors red",
        ),
        ('name = "a"\n' + UNMASK + "phrases.shade = {}", "There is no key of phrases"),
    ],
)
def test_a_bad_file_is_told_in_one_sentence(tmp_path, text, complaint):
    path = write(tmp_path, text)
    with pytest.raises(InvalidValueError) as caught:
        read_wordings(path)
    assert complaint in str(caught.value)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_file_that_cannot_be_read_is_told(tmp_path):
    with pytest.raises(InvalidValueError, match="cannot be read"):
        read_wordings(tmp_path / "missing.toml")
    with pytest.raises(InvalidValueError, match="cannot be read"):
        read_wordings(tmp_path)
    (tmp_path / "bytes.toml").write_bytes(b"\xff")
    with pytest.raises(InvalidValueError, match="cannot be read"):
        read_wordings(tmp_path / "bytes.toml")


def test_a_changed_file_is_other_wordings(tmp_path):
    path = write(tmp_path)
    identity = open_wordings(path)
    path.write_text(HAND.replace("Could you", "Will you"))
    changed = open_wordings(path)
    assert changed != identity
    assert open_wordings(path, identity) == identity  # this process still has it
    gone = "by-hand@00000000"
    with pytest.raises(InvalidValueError, match=f"holds {changed}, but the episodes need {gone}"):
        open_wordings(path, gone)
    with pytest.raises(InvalidValueError, match="need their file; none was given"):
        open_wordings(None, gone)
    with pytest.raises(InvalidValueError, match="are not open"):
        find_wordings(gone)
    with pytest.raises(InvalidValueError, match="are not open"):
        instruct_with(episode_with("PickXtimes"), InstructionOptions(wordings=gone))
    assert open_wordings(None) is None


TEXT = st.text(st.characters(codec="utf-8", exclude_characters="[]{}", exclude_categories=["C"]))
PHRASES = st.builds(StatedPhrase, TEXT, TEXT.filter(bool), TEXT)


@given(
    TEXT.filter(str.strip),
    st.dictionaries(st.sampled_from(["red", "green", "blue"]), PHRASES, min_size=1),
    st.dictionaries(st.sampled_from(["red", "green", "blue"]), PHRASES, min_size=1),
    st.sets(st.sampled_from(["direct", "spatial"])),
    TEXT,
)
def test_what_is_written_is_read_again(words, first, second, own, source):
    commands = (
        WordedCommand(f"{{colors.0}}{words}", {"colors": ("red",)}, {"colors.0": first}),
        WordedCommand(
            f"{words}{{colors.0}}{{colors.1}}", {}, {"colors.0": first, "colors.1": second}
        ),
    )
    text = wording_text("a", source, {"VideoUnmask": TaskWordings(commands, frozenset(own))})
    read = parse_wordings(text, "file")
    assert (read.name, read.source) == ("a", source)
    found = read.tasks["VideoUnmask"]
    assert found.own == own
    assert [(one.text, one.when) for one in found.commands] == [
        (one.text, one.when) for one in commands
    ]
    for before, after in zip(commands, found.commands, strict=True):
        for field, table in before.phrases.items():
            for value, phrase in table.items():
                assert after.phrase(field, value) == phrase


def test_the_first_command_that_fits_is_used():
    one = StatedPhrase("", "x", "")
    commands = TaskWordings(
        (
            WordedCommand("once", {"repeats": 1}),
            WordedCommand("{repeats}", {}, {"repeats": {"1": one, "2": one}}),
        )
    )
    assert commands.find(Goal.of(repeats=1)) is commands.commands[0]
    assert commands.find(Goal.of(repeats=2)) is commands.commands[1]
    assert commands.find(Goal.of(repeats=3)) is None
    assert commands.find(Goal.of(repeats=3), ["repeats"]) is commands.commands[1]
    assert commands.find(Goal.of(repeats=1), ["repeats"]) is commands.commands[1]
    assert commands.find(Goal.of(repeats=1, color="red")) is None
