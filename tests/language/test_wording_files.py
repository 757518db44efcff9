"""Wording files: by hand, bad ones, and their identity."""

import dataclasses
import re
from dataclasses import replace
from pathlib import Path

import pytest
from wording_stand_ins import same_number, train_episodes

from roboirg.apps.language_lab.validation import episode_checks
from roboirg.apps.language_lab.validation.episode_checks import check_episode, unpaired
from roboirg.apps.language_lab.validation.leaks import find_leaks
from roboirg.core.episode import Goal
from roboirg.core.errors import InvalidValueError
from roboirg.core.goal_slots import COLOR_SLOTS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import FORMS, generator, instruct, instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.instruction_row import row
from roboirg.language.phrases import plain
from roboirg.language.request import InstructionSpec, UtteranceSpec
from roboirg.language.settings import get_setting
from roboirg.language.variants import instructions
from roboirg.language.worded_command import StatedPhrase, TaskWordings, WordedCommand
from roboirg.language.wordings.wording_file import parse_wordings, read_wordings
from roboirg.language.scenarios.wording_store import find_wordings, open_wordings, register_wordings
from roboirg.reader import interpret
from roboirg.tasks import get_task

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


def opened(tables: str) -> str:
    """The identity of open wordings with these tables."""
    return register_wordings(parse_wordings(f"name = 'hand'\n{tables}", "file"))


def episode_with(task: str, **slots):
    """A training episode with such a goal."""
    return next(
        one
        for one in train_episodes(task, 0, 100)
        if slots.items() <= one.goal.as_mapping().items()
    )


def pointer(said):
    """The words of a command that point at a thing."""
    last = len(said.utterances) - 1
    return next(
        said.span(one) for one in said.mentions
        if one.utterance == last and one.role == "anaphor" and one.slot in COLOR_SLOTS
    )  # fmt: skip


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
    assert direct.command == (
        f"Could you put {pointer(direct)} on the target {same_number(direct)}, "
        "and press the button?"
    )
    assert interpret(direct.text, once.scene, "PickXtimes").goals == (once.goal,)
    hidden = instruct(episode_with("VideoUnmask", colors=("red",)), "direct", wordings=identity)
    assert hidden.command == f"lift the container with {pointer(hidden)}"


def test_the_example_in_the_docs_is_read_and_valid():
    page = (Path(__file__).parents[2] / "docs" / "wording-files.md").read_text()
    (example,) = re.findall(r'```toml\n(name = "workshop".*?)```', page, re.DOTALL)
    identity = register_wordings(parse_wordings(example, "example"))
    for task in ("PickXtimes", "VideoUnmask"):
        for episode in train_episodes(task, 0, 3):
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
        ('name = "a"\n' + UNMASK.replace("lift {", "lift {{"), "has a bracket that is not a field"),
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
        (
            'name = "a"\n' + UNMASK + "when = { colors = 'red' }",
            "has the condition colors = 'red'; it must be a list of words.",
        ),
        (
            'name = "a"\n' + UNMASK + "when = { counts = [1, 'a'] }",
            "has the condition counts = [1, 'a']; it must be a list of numbers.",
        ),
        (
            'name = "a"\n' + UNMASK + "when = { repeats = '1' }",
            "has the condition repeats = '1'; it must be a number.",
        ),
        (
            'name = "a"\n' + UNMASK + "when = { color = ['red'] }",
            "has the condition color = ['red']; it must be a word.",
        ),
        (
            'name = "a"\n' + UNMASK.replace("lift", "soulève"),
            "has the words 'soulève {colors.0}'; they must be printable ASCII on one line",
        ),
        (
            'name = "a"\n' + UNMASK + 'phrases.colors = { red = "a\\nb" }',
            "has the words 'a\\nb'; they must be printable ASCII on one line",
        ),
        (
            'name = "a"\n' + UNMASK + 'phrases.colors = { red = "the [red] container" }',
            "the brackets must hold a whole phrase with its article, such as [the red cube].",
        ),
        (
            'name = "a"\n' + UNMASK + 'phrases.colors = { red = "x" }\npointed = "colors.0"',
            "has pointed = 'colors.0'; it must be a list of fields of the command",
        ),
        (
            'name = "a"\n' + UNMASK + 'phrases.colors = { red = "x" }\npointed = ["colors"]',
            "Did you mean 'colors.0'?",
        ),
        (
            'name = "a"\n' + UNMASK + 'phrases.colors = { red = "  " }',
            "has the phrase '  ' for colors red; it must be words",
        ),
        (
            'name = "a"\n' + UNMASK + 'phrases.colors = { red = "the [ ] cube" }',
            "has the phrase 'the [ ] cube' for colors red; it must be words",
        ),
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
    with pytest.raises(InvalidValueError, match=f"holds {changed}, but the episodes need {gone}"):
        open_wordings(changed, gone)
    assert open_wordings(changed) == changed
    with pytest.raises(InvalidValueError, match="need their file; none was given"):
        open_wordings(None, gone)
    with pytest.raises(InvalidValueError, match="are not open"):
        find_wordings(gone)
    with pytest.raises(InvalidValueError, match="are not open"):
        instruct_with(episode_with("PickXtimes"), InstructionOptions(wordings=gone))
    assert open_wordings(None) is None


def test_a_count_and_a_cube_may_be_one_phrase():
    identity = opened(
        """
        [BinFill.phrases]
        cubes = { "2 red" = "2 red cubes", "1 red" = "1 red cube" }
        [[BinFill.commands]]
        text = "put {cubes.0} into the bin, then press the button"
        """
    )
    episode = replace(episode_with("BinFill"), goal=Goal.of(colors=("red",), counts=(2,)))
    explicit = instruct(episode, wordings=identity)
    assert explicit.text == "put 2 red cubes into the bin, then press the button"
    assert [explicit.span(one) for one in explicit.mentions] == ["2 red cubes"]
    for form in FORMS:
        assert instruct(episode, "direct", form, wordings=identity).metadata["command"] != "own"


OWN_SENTENCES = """
[PickXtimes.phrases]
color = { red = "the red cube", green = "the green cube", blue = "the blue cube" }
[[PickXtimes.commands]]
when = { repeats = 1 }
text = "put {color} on the target once, then press the button"
[[PickXtimes.commands]]
when = { repeats = 2 }
text = "twice, put {color} on the target, then press the button"
"""


OWN_SETTINGS = """[PickXtimes]
own = ["direct"]
[PickXtimes.phrases]
"""


@pytest.mark.parametrize("setting", ["direct", "contextual"])
def test_both_forms_have_our_command_or_none(setting):
    identity = opened(OWN_SENTENCES)
    episode = episode_with("PickXtimes", repeats=2)
    for form in FORMS:
        said = instruct(episode, setting, form, wordings=identity)
        assert said.metadata["command"] == "own"
        assert said.text == instruct(episode, setting, form).text
    assert not list(unpaired(episode, [setting], identity))
    # The number is stated in both.
    for form in FORMS:
        said = instruct(episode, "spatial", form, wordings=identity)
        assert said.metadata["command"].startswith("twice, put")


@pytest.mark.parametrize(
    ("task", "phrases", "text"),
    [
        ("StopCube", "visit = { 3 = 'the third time' }", "stop the cube at the target for {visit}"),
        ("StopCube", "visit = { 3 = '[its third visit]' }", "stop the cube on {visit}"),
        (
            "PickXtimes",
            "repeats = { 3 = 'three times' }\ncolor = { red = 'the red cube' }",
            "put {color} on the target, doing this for {repeats}, then press the button",
        ),
        (
            "VideoPlaceOrder",
            "placement = { 3 = 'the third target' }\ncolor = { red = 'the red cube' }",
            "place {color} on {placement} it was placed on",
        ),
        (
            "VideoPlaceOrder",
            "placement = { 3 = 'the third time' }\ncolor = { red = 'the red cube' }",
            "place {color} on the target where a cube was placed {placement}",
        ),
        (
            "VideoPlaceButton",
            """relation = { after = 'the target [right after the button press]' }
            color = { red = 'the red cube' }""",
            "place {color} on {relation}",
        ),
        (
            "VideoPlaceButton",
            """relation = { after = 'right after the button press' }
            color = { red = 'the red cube' }""",
            "place {color} on the target {relation}",
        ),
    ],
)
def test_a_phrase_that_no_expression_can_replace_leaves_our_command(task, phrases, text):
    identity = opened(f"[{task}.phrases]\n{phrases}\n[[{task}.commands]]\ntext = '{text}'")
    goals = {"visit": 3, "repeats": 3, "placement": 3, "relation": "after"}
    (slot,) = goals.keys() & episode_with(task).goal.as_mapping().keys()
    color = {} if task == "StopCube" else {"color": "red"}
    episode = episode_with(task, **{slot: goals[slot]}, **color)
    assert instruct(episode, wordings=identity).metadata["command"] == text
    for form in FORMS:
        said = instruct(episode, "direct", form, wordings=identity)
        assert said.metadata["command"] == "own"
        assert said.text == instruct(episode, "direct", form).text


def test_a_command_may_be_for_referring_expressions_only():
    identity = opened(
        """
        [VideoRepick.phrases]
        repeats = { 2 = "for two times", 3 = "for three times" }
        [[VideoRepick.commands]]
        pointed = ["repeats"]
        text = "lift the cube of the video and put it down, doing so {repeats}"
        [[VideoRepick.commands]]
        text = "repeatedly lift the cube of the video and put it down {repeats}"
        """
    )
    episode = episode_with("VideoRepick", repeats=2)
    stated = "repeatedly lift the cube of the video and put it down for two times"
    assert instruct(episode, wordings=identity).text == stated
    assert instruct(episode, "direct", "resolved", wordings=identity).command == stated
    said = instruct(episode, "direct", wordings=identity)
    assert said.command == (
        f"lift the cube of the video and put it down, doing so {same_number(said)}"
    )


def test_a_setting_under_own_ignores_the_commands():
    identity = opened(f"{OWN_SENTENCES.replace('[PickXtimes.phrases]', OWN_SETTINGS)}")
    without_command = episode_with("PickXtimes", repeats=3)
    said = instruct(without_command, "direct", wordings=identity)
    assert said.text == instruct(without_command, "direct").text
    assert (said.metadata["command"], said.metadata["wordings"]) == ("own", identity)
    with pytest.raises(InvalidValueError, match="have no command of PickXtimes"):
        instruct(without_command, "spatial", wordings=identity)
    # A command from outside has no rival; our own has.
    rival = InstructionOptions("direct-rival")
    assert find_refusal(without_command, rival) is None
    options = dataclasses.replace(rival, wordings=identity)
    assert find_refusal(without_command, options) is None
    drawn = instruct_with(without_command, options)
    assert drawn.text == instruct_with(without_command, rival).text
    assert drawn.metadata["rival"] is not None


def test_a_pair_with_our_command_in_one_form_is_no_pair(monkeypatch):
    episode = episode_with("PickXtimes", repeats=2)
    identity = opened(OWN_SENTENCES)

    def say(one, options):
        outside = identity if options.form == "resolved" else None
        setting = "explicit" if outside else "direct"
        return instruct_with(one, dataclasses.replace(options, setting=setting, wordings=outside))

    monkeypatch.setattr(episode_checks, "instruct_with", say)
    assert ("direct", "resolved, more than its references differ") in unpaired(episode, ["direct"])


BRACKETS = """
[PickXtimes.phrases]
color = { red = "our friend [the red cube] on the table" }
repeats = { 2 = "[twice] please", 3 = "exactly [three times]" }
[[PickXtimes.commands]]
text = "put {color} on the target {repeats}, then press the button"

[BinFill.phrases]
cubes = { "2 red" = "two [red cubes] of the table" }
[[BinFill.commands]]
text = "put {cubes.0} into the bin, then press the button"
"""


def test_words_around_brackets_stay():
    identity = opened(BRACKETS)
    red = [episode_with("PickXtimes", color="red", repeats=repeats) for repeats in (2, 3)]
    twice, thrice = (instruct(one, "direct", wordings=identity) for one in red)
    assert twice.command == (
        f"put our friend {pointer(twice)} on the table on the target {same_number(twice)} please, "
        "then press the button"
    )
    assert thrice.command == (
        f"put our friend {pointer(thrice)} on the table on the target exactly "
        f"{same_number(thrice)}, then press the button"
    )
    said = instruct(red[0], "spatial", wordings=identity).command
    assert re.search(r"put our friend the cube .* on the table on the target twice please", said)
    said = next(
        instruct(one, "reasoning", wordings=identity)
        for one in train_episodes("PickXtimes", 0, 100)
        if one.goal["color"] == "red" and one.goal["repeats"] == 2
        and instruct(one, "reasoning").metadata["pattern"] == "number deduction"
    ).command  # fmt: skip
    assert said.startswith("put our friend the red cube on the table on the target ")
    assert said.endswith(" please, then press the button")
    cubes = replace(episode_with("BinFill"), goal=Goal.of(colors=("red",), counts=(2,)))
    said = instruct(cubes, "direct", wordings=identity).command
    assert said in {
        f"put {words} of the table into the bin, then press the button"
        for words in ("that many of them", "two of them", "two of the former", "two of the latter")
    }


def test_the_phrases_of_a_command_stay_with_it():
    identity = opened(
        """
        [PickXtimes.phrases]
        color = { red = "the red cube" }
        repeats = { 1 = "one time", 2 = "twice" }
        [[PickXtimes.commands]]
        when = { color = "red" }
        phrases.repeats = { 1 = "just [once]" }
        text = "put our cube on the target {repeats}, then press the button"
        [[PickXtimes.commands]]
        when = { repeats = 1 }
        phrases.color = { red = "our [red cube]" }
        text = "put {color} on the target, then press the button"
        [[PickXtimes.commands]]
        text = "take {color}, put it on the target {repeats}, then press the button"
        """
    )
    episode = episode_with("PickXtimes", color="red", repeats=1)
    direct = instruct(episode, "direct", wordings=identity)
    assert direct.command == (
        f"take it, put it on the target {same_number(direct)}, then press the button"
    )
    spatial = instruct(episode, "spatial", wordings=identity).command
    assert re.fullmatch("put our the cube .* on the target, then press the button", spatial)
    wordings = find_wordings(identity).tasks["PickXtimes"]
    third = wordings.commands[2]
    assert wordings.phrase(episode.goal, "repeats").text == "just once"
    assert wordings.phrase(episode.goal, "repeats", third).text == "one time"


@pytest.mark.parametrize(
    ("when", "text", "leaked"),
    [
        ("", "put {cubes.0} and {cubes.1} in", set()),
        ("", "put {cubes.0} and {cubes.1} in, 2 kinds", set()),  # every goal has it
        ("", "put {cubes.0} and {cubes.1} in", {"1"}),
        ("when = { counts = [2, 1] }", "put {cubes.0} and {cubes.1} in, 2 and 1", {"1", "2"}),
    ],
)
def test_a_count_in_a_command_is_a_leak_unless_every_goal_has_it(when, text, leaked):
    after = ", 1 by 1" if leaked == {"1"} else ""
    identity = opened(
        f"""
        [BinFill.phrases]
        cubes = {{ "2 red" = "two [red cubes]", "1 blue" = "one [blue cube]{after}" }}
        [[BinFill.commands]]
        {when}
        text = "{text}"
        """
    )
    goal = Goal.of(colors=("red", "blue"), counts=(2, 1))
    said = instruct(replace(episode_with("BinFill"), goal=goal), "direct", wordings=identity)
    assert find_leaks(said, goal) == leaked


def test_a_goal_without_a_command_is_a_refusal_with_a_reason():
    identity = opened(OWN_SENTENCES)
    missing = episode_with("PickXtimes", repeats=3)
    options = InstructionOptions("direct", wordings=identity)
    assert find_refusal(missing, options) == (
        f"wordings {identity} have no command of PickXtimes for the goal of episode "
        f"{missing.key}: {missing.goal['color']}, 3 times"
    )
    with pytest.raises(InvalidValueError, match=r"^The wordings hand@.* 3 times\.$"):
        instruct_with(missing, options)
    told = episode_with("PickXtimes", repeats=1)
    said = list(instructions([missing, told], ["explicit"], ["implicit"], options))
    assert [episode for episode, _ in said] == [told]
    found = check_episode(missing, wordings=identity)
    assert not found.texts
    assert not found.failures


def test_a_setting_may_speak_without_the_command(monkeypatch):
    spec = InstructionSpec((UtteranceSpec("command", plain("do as before")),))
    setting = replace(get_setting("direct", get_task("PickXtimes")), say=lambda _request: spec)
    monkeypatch.setattr(generator, "get_setting", lambda _name, _task: setting)
    said = instruct(episode_with("PickXtimes", repeats=1), "direct", wordings=opened(OWN_SENTENCES))
    assert (said.text, said.metadata["command"]) == ("Do as before", "own")


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
