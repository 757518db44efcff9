"""Wording files: a user's own sentences, commands and scenarios, in a TOML file.

An open file has an identity, ``hand@1a2b3c4d``: its name and a digest of what it says.
"""

import contextlib
import itertools
import re
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from page_text import call
from typer.testing import CliRunner
from wording_stand_ins import take_words, train_episodes

from roboirg import main as cli
from roboirg.core.episode import Goal
from roboirg.core.errors import InvalidValueError, RoboIRGError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.language import (
    FORMS,
    expressible,
    instruct,
    instruct_with,
    open_wordings,
    token_counts,
)
from roboirg.language.generator import find_refusal
from roboirg.language.instruction_row import row
from roboirg.language.meaning import command_goals
from roboirg.language.request import values_of_goal
from roboirg.language.scenarios.identity import words_digest, words_of
from roboirg.language.scenarios.wording_file import parse_wordings, read_wordings
from roboirg.language.scenarios.wording_store import register_wordings
from roboirg.shortcuts.command_chance import blind_goals, goals_of_command, understood_goals
from roboirg.tasks.splits.splits import get_episode

PAGE = (Path(__file__).parents[2] / "docs/add-scenario.md").read_text()
SMALLEST_FILE_OF_THE_PAGE, ADDED_TO_IT, _, SENTENCE_FILE_OF_THE_PAGE = re.findall(
    r"```toml\n(.*?)```", PAGE, re.DOTALL
)
"""The page's examples: a scenario; one more and a command; spatial ones; a whole sentence."""
COMMAND_FILE_OF_THE_PAGE = SMALLEST_FILE_OF_THE_PAGE + ADDED_TO_IT
each_pool = pytest.mark.parametrize("pool", POOLS)
EPISODE = get_episode("PickXtimes", "test", 3)
"""Its goal is to put the blue of three cubes on the target four times."""
HEAD = 'name = "hand"\ntasks = ["PickXtimes"]\n'
TWO_SENTENCES = """
name = "hand"
tasks = ["PickXtimes"]
[[literal]]
task = "PickXtimes"
when = { color = "red", repeats = 2 }
text = "lift the red cube to the target, repeat 2"
[[literal]]
task = "PickXtimes"
when = { color = "blue", repeats = 2 }
text = "lift the blue cube to the target, repeat 2"
"""
DUSTY = """
name = "hand"
tasks = ["PickXtimes"]
[[scenario]]
frame = "dusty"
setting = "spatial"
introduction = "It's dusty {place:spot}."
say.color = ["the cube <there place: there>"]
"""
PAINT = """
name = "hand"
tasks = ["PickXtimes"]
[[scenario]]
frame = "paint"
setting = "direct"
introduction = "We painted the {color} cube."
reinforcement = "It is new."
distractors = ["I still have to wash the brushes."]
competing = ["The {rival color} one comes next week."]
cue = "So let's go."
lead = "So "
say.color = ["<it color: it>"]
"""


def identity_of(text):
    """Open a wording file with this text, and return its identity."""
    return register_wordings(parse_wordings(text, "words.toml"))


def episode_with(task, **slots):
    """Return the first training episode whose goal has these values."""
    for episode in train_episodes(task, 0, 100):
        if slots.items() <= episode.goal.as_mapping().items():
            return episode
    raise LookupError(slots)


def test_a_sentence_of_a_user_s_file_is_said_in_the_explicit_setting_only():
    """The user's file has whole sentences, one of them for the red cube, twice, which is the goal.
    *Explicit* says it; *direct*, which refers back, says what it says without the file."""
    identity = identity_of(TWO_SENTENCES)
    episode = episode_with("PickXtimes", color="red", repeats=2)

    explicit = instruct(episode, "explicit", wordings=identity)
    direct = instruct(episode, "direct", wordings=identity)

    assert explicit.text == "lift the red cube to the target, repeat 2"
    assert direct.text == instruct(episode, "direct").text


@pytest.mark.parametrize(
    ("setting", "sentence"),
    [("explicit", "lift the red cube to the target, repeat 2"), ("direct", "own")],
)
def test_metadata_and_exported_rows_name_the_wording_file_and_its_sentence(setting, sentence):
    """A user's file has a whole sentence for the red cube, twice, which the setting *explicit*
    says. *Direct* refers back, and so makes its own command of our words: "own" stands where the
    sentence would. Both name the file by its identity."""
    identity = identity_of("""
name = "hand"
tasks = ["PickXtimes"]
[[literal]]
task = "PickXtimes"
when = { color = "red", repeats = 2 }
text = "lift the red cube to the target, repeat 2"
""")
    episode = episode_with("PickXtimes", color="red", repeats=2)

    said = instruct(episode, setting, wordings=identity)

    exported = row(episode, said)
    assert said.metadata["wordings"] == exported["wordings"] == identity
    assert said.metadata["command"] == exported["whole_sentence"] == sentence


def test_a_whole_sentence_hides_no_value():
    """The file has the sentence *lift the red cube to the target, repeat 2*. It states the goal, so
    nothing has to be found out."""
    episode = episode_with("PickXtimes", color="red", repeats=2)
    said = instruct(episode, wordings=identity_of(TWO_SENTENCES))
    assert said.metadata["hidden_slots"] == 0


def test_a_goal_without_a_sentence_in_a_user_s_file_is_refused_in_explicit():
    """The file has sentences for red and blue cubes, twice. The goal is a green one, which the
    setting *explicit* would have to state in words of the file."""
    identity = identity_of(TWO_SENTENCES)
    episode = episode_with("PickXtimes", color="green", repeats=2)
    complaint = "has no sentence of PickXtimes for the goal: green, twice; leave explicit out"

    with pytest.raises(InvalidValueError, match=f"{identity} {complaint}"):
        instruct(episode, wordings=identity)


def test_a_goal_without_a_sentence_in_a_user_s_file_can_be_said_in_other_settings():
    """The goal is a green cube; the file has sentences for red and blue ones. *Direct* does not
    state the goal in a sentence, so it uses our words."""
    episode = episode_with("PickXtimes", color="green", repeats=2)
    assert instruct(episode, "direct", wordings=identity_of(TWO_SENTENCES)).text


SENTENCE_FOR_VIDEOREPICK = """
name = "a"
tasks = ["VideoRepick"]
[[literal]]
task = "VideoRepick"
when = { repeats = 2 }
text = "go"
"""


def test_a_user_s_sentences_can_serve_a_task_that_has_no_words_of_ours(monkeypatch):
    """`take_words` removes our words of VideoRepick, as if none had been written. The user's file
    has the sentence *go* for two repetitions."""
    take_words(monkeypatch, "VideoRepick")
    identity = identity_of(SENTENCE_FOR_VIDEOREPICK)
    episode = replace(episode_with("VideoRepick"), goal=Goal.of(repeats=2))

    assert instruct(episode, wordings=identity).text == "go"


def test_a_task_without_words_of_ours_can_be_said_by_whole_sentences_only(monkeypatch):
    """`take_words` removes our words of VideoRepick. The user's file has the sentence *go*; the
    setting *direct* would need a scenario or a command."""
    take_words(monkeypatch, "VideoRepick")
    identity = identity_of(SENTENCE_FOR_VIDEOREPICK)

    with pytest.raises(InvalidValueError, match="VideoRepick names no file of words"):
        instruct(episode_with("VideoRepick"), "direct", wordings=identity)


@pytest.mark.parametrize("goals_left", [understood_goals, goals_of_command, blind_goals])
def test_a_sentence_given_for_two_goals_means_both(goals_left):
    """The file gives *do the usual with the red cube* for once and for twice. Whatever finds the
    goals that a text leaves open must find both: from text and scene, from the command alone, and
    without the scene."""
    identity = identity_of("""
name = "hand"
tasks = ["PickXtimes"]
[[literal]]
task = "PickXtimes"
when = { color = "red", repeats = 1 }
text = "do the usual with the red cube"
[[literal]]
task = "PickXtimes"
when = { color = "red", repeats = 2 }
text = "do the usual with the red cube"
""")
    episode = episode_with("PickXtimes", color="red", repeats=1)

    said = instruct(episode, wordings=identity)

    assert set(goals_left(said, episode)) == {
        Goal.of(color="red", repeats=1),
        Goal.of(color="red", repeats=2),
    }


def run_check(text, folder):
    """Write a wording file, and return the outcome of `language check-scenarios` on it."""
    file = folder / "mine.toml"
    file.write_text(text)
    return CliRunner().invoke(cli.app, ["language", "check-scenarios", str(file)])


def print_of_passed_check(text, folder):
    """Write a wording file that passes the check in published scenes; return what this prints."""
    file = folder / "mine.toml"
    file.write_text(text)
    return call("language", "check-scenarios", file, "--seeds", "0")


def test_the_example_file_of_the_documentation_passes_the_check(tmp_path):
    """docs/add-scenario.md shows a file with a command, for *explicit*, and the scenarios "fresh
    paint" and "photos", for *direct*."""
    printed = print_of_passed_check(COMMAND_FILE_OF_THE_PAGE, tmp_path)

    assert "explicit (PickXtimes)" in printed
    assert "photos (PickXtimes, direct, both pools)" in printed


@pytest.fixture
def without_tokenizer(monkeypatch):
    """No tokenizer is installed, as after `make setup`, and no length of a text is known yet."""
    token_counts.tokens_of.cache_clear()
    monkeypatch.setattr(token_counts, "_tokenizer", lambda: None)
    yield
    token_counts.tokens_of.cache_clear()


def test_the_example_file_passes_the_check_where_no_tokenizer_is_installed(
    tmp_path, without_tokenizer
):
    """Policies hear 64 tokens. Without a tokenizer, only an upper bound of a text's length is
    known, *at most N tokens*. That of the page's example, whose texts have 60 at most, is more than
    64; but a text is refused only if it is sure to be too long."""
    printed = print_of_passed_check(COMMAND_FILE_OF_THE_PAGE, tmp_path)

    bounds = [int(bound) for bound in re.findall(r"at most (\d+) of 64 tokens", printed)]
    assert max(bounds) > 64


def test_the_identity_of_an_open_file_is_its_name_and_a_digest(tmp_path):
    """docs/add-scenario.md shows a file with the line `name = "workshop"`. The identity has this
    name, and not that of the file."""
    file = tmp_path / "mine.toml"
    file.write_text(COMMAND_FILE_OF_THE_PAGE)
    assert re.fullmatch("workshop@[0-9a-f]{8}", open_wordings(file))


def test_the_text_that_the_documentation_quotes_is_said_in_a_training_episode():
    """docs/add-scenario.md shows a file with the scenarios "fresh paint" and "photos", and quotes
    a text of the first, *We have just painted the red cube. …*. One of the 100 published training
    episodes must say this very text; both scenarios must be said in some."""
    (quoted,) = re.findall(r"\*(We have just\spainted the red cube\.[^*]*)\*", PAGE)
    identity = identity_of(COMMAND_FILE_OF_THE_PAGE)
    scenario_of_text = {}

    for episode in train_episodes("PickXtimes", 0, 100):
        said = instruct(episode, "direct", wordings=identity)
        scenario_of_text[said.text] = said.metadata["scenario"]

    assert scenario_of_text[quoted.replace("\n", " ")] == "fresh paint"
    assert set(scenario_of_text.values()) == {"fresh paint", "photos"}


def test_the_example_commands_of_the_documentation_state_every_goal(tmp_path):
    """docs/add-scenario.md has a table with commands for four tasks, as here. In a file, they must
    pass the check, which reports a goal that a command does not state; it prints a line *explicit
    (TASK)* for each task with commands."""
    commands = """
SwingXtimes = ['Move {color} to both targets {repeats}.']
StopCube = ['Press the button {visit}.']
BinFill = ['Put {cubes} into the bin.']
VideoUnmask = ['Lift {colors.0}.', 'Lift {colors.0}, then {colors.1}.']
"""
    head = 'name = "mine"\ntasks = ["SwingXtimes", "StopCube", "BinFill", "VideoUnmask"]\n'

    printed = print_of_passed_check(f"{head}[commands]{commands}", tmp_path)

    assert commands == commands_of_the_page()
    assert printed.count("explicit (") == 4


def commands_of_the_page():
    """Return the page's table of tasks and commands as lines of TOML."""
    lines = "\n"
    for task, cell in re.findall(r"\n\| ([A-Z]\w+)[^|]* \| (`[^|]+`) \|", PAGE):
        lines += f"{task} = {re.findall('`(.*?)`', cell)}\n"
    return lines


def test_goals_without_a_sentence_are_listed_but_are_no_error(tmp_path):
    """docs/add-scenario.md shows a file with sentences for the first two of the five visits of
    StopCube; three are left."""
    printed = print_of_passed_check(SENTENCE_FILE_OF_THE_PAGE, tmp_path)

    assert "3 goals, such as: on visit 3; on visit 4; on visit 5. Episodes" in printed


def test_at_most_ten_goals_without_a_sentence_are_listed(tmp_path):
    """The file has sentences for two of the fifteen goals of PickXtimes: three colors, once to five
    times. Of the thirteen that are left, ten are named."""
    printed = print_of_passed_check(TWO_SENTENCES, tmp_path)
    (listed,) = re.findall(r"No sentence of 13 goals, such as: (.*)\. Episodes", printed)
    assert len(set(listed.split("; "))) == 10


def test_the_check_reports_a_sentence_for_an_impossible_goal(tmp_path):
    """docs/add-scenario.md shows a file with a sentence for the second visit of StopCube's cube.
    Here it is for visit 99, and the cube makes at most five."""
    text = SENTENCE_FILE_OF_THE_PAGE.replace("visit = 2", "visit = 99")

    checked = run_check(text, tmp_path)

    assert "BROKEN states no goal" in checked.output
    assert "  No scene has the goal of a sentence: on visit 99\n" in checked.output


def test_a_mistake_in_a_command_for_training_and_tests_is_reported_once():
    """Under `all` a command serves both training and tests. *Très* has a letter that is not ASCII,
    which is reported for the command and not for each of the two."""
    with pytest.raises(InvalidValueError) as caught:
        parse_wordings(f"{HEAD}[commands]\nall = ['Très {{color}} {{repeats}}.']", "words.toml")
    assert str(caught.value).count("printable ASCII") == 1


JUGGLE = """
name = "hand"
tasks = ["PickXtimes"]
[commands]
all = ["Juggle {color} {repeats}."]
"""


def shown_words(file, split, index):
    """Return what `roboirg show` prints of the words of an episode of PickXtimes in all settings,
    with those of a user's file."""
    return call("show", "PickXtimes", index, "--split", split, "--words", "--wordings", file)


def test_words_outside_our_table_have_an_exact_length_with_a_tokenizer(tmp_path):
    """JUGGLE, a user's file, has the command *Juggle the blue cube four times*. *Juggle* is in no
    table of token counts, so the tokenizer counts it: 11 tokens, in the check of the file and where
    the words of an episode are shown."""
    printed = print_of_passed_check(JUGGLE, tmp_path)

    assert "\n  11 of 64 tokens; states 15 goals." in printed
    assert "explicit (11 tokens)" in shown_words(tmp_path / "mine.toml", "test", 3)


def test_words_outside_our_table_have_an_upper_bound_without_a_tokenizer(
    tmp_path, without_tokenizer
):
    """JUGGLE, a user's file, has the command *Juggle the blue cube four times*. *Juggle* is in no
    table of token counts, so without a tokenizer only an upper bound is known, the same in the
    check of the file and where the words of an episode are shown."""
    printed = print_of_passed_check(JUGGLE, tmp_path)

    (bound,) = re.findall(r"\n  (at most \d+) of 64 tokens; states 15 goals\.", printed)
    assert f"explicit ({bound} tokens)" in shown_words(tmp_path / "mine.toml", "test", 3)


def test_the_check_reports_scenes_that_no_scenario_of_the_file_fits(tmp_path):
    """DUSTY has one scenario, *It's dusty* with words for where the cube is, such as *on the left*.
    In some scenes the cube has none, for example in PickXtimes/train/2. The check ends with an
    error, and prints a command that shows why."""
    checked = run_check(DUSTY, tmp_path)

    assert isinstance(checked.exception, RoboIRGError)
    assert "BROKEN PickXtimes: spatial has no scenario that fits " in checked.output
    command = "roboirg show PickXtimes 2 --split train --words --wordings"
    assert f"see why with `{command} {tmp_path / 'mine.toml'}`" in checked.output


def test_the_words_of_a_scene_that_no_scenario_of_the_file_fits_say_why(tmp_path):
    """DUSTY has one scenario, *It's dusty* with words for where the cube is, such as *on the left*.
    In PickXtimes/train/2 the cube has none. The command is the one that the check of the file
    names."""
    (tmp_path / "mine.toml").write_text(DUSTY)

    shown = shown_words(tmp_path / "mine.toml", "train", 2)

    assert "spatial cannot express the episode: " in shown
    assert "mine.toml has no spatial scenario for it in the pool train: nothing has the pl" in shown


@pytest.mark.parametrize(
    ("commands", "complaint"),
    [
        ('all = ["Lift {color}."]', "has no command of PickXtimes with {color} and {repeats}"),
        (
            'all = ["Lift {color} {repeats}."]\n[stated.all]\ncolor = "a cube"',
            "and of others or none",
        ),
        (f'all = ["Lift {{color}} {{repeats}}{" again" * 60}."]', "tokens; only 64 are heard"),
    ],
    ids=["no number", "no color", "too long"],
)
def test_the_check_reports_a_command_that_does_not_state_the_goal(tmp_path, commands, complaint):
    """HEAD has the file's name and its task PickXtimes, whose commands have to say color and
    number; `stated.all.color` are the words for a color. The first command lacks the number, the
    second says every color as *a cube*, and the third is longer than the 64 tokens that policies
    hear."""
    checked = run_check(f"{HEAD}[commands]\n{commands}\n", tmp_path)
    assert complaint in checked.output


@each_pool
def test_a_user_s_spatial_scenario_replaces_ours_in_the_spatial_setting(pool):
    """DUSTY, a user's file, has the spatial scenario "dusty". Where it fits one of twelve episodes,
    it is said; where it does not, ours must not step in, and the episode is refused."""
    options = InstructionOptions("spatial", wordings=identity_of(DUSTY))
    said = set()
    for index in range(12):
        episode = get_episode("PickXtimes", pool, index)
        if find_refusal(episode, options) is None:
            said.add(instruct_with(episode, options).metadata["scenario"])
    assert said == {"dusty"}


@each_pool
def test_a_user_s_spatial_scenario_leaves_the_other_settings_alone(pool):
    """DUSTY, a user's file, has one scenario of the setting *spatial* for PickXtimes, and nothing
    else. In twelve episodes, each other setting that can be said with or without the file must be
    said both with it and without it, in both forms and in the same words."""
    identity = identity_of(DUSTY)
    for index in range(12):
        episode = get_episode("PickXtimes", pool, index)
        settings = {*expressible(episode), *expressible(episode, wordings=identity)}
        for setting, form in itertools.product(settings - {"spatial"}, FORMS):
            ours = instruct(episode, setting, form)
            said = instruct(episode, setting, form, wordings=identity)
            assert (said.turns, said.mentions) == (ours.turns, ours.mentions), (index, setting)


def test_a_scenario_for_training_is_not_said_in_test_episodes():
    """DUSTY, a user's file, has one spatial scenario, here with the line `pool = "train"`, which
    keeps it out of the words of tests."""
    text = DUSTY.replace("setting", 'pool = "train"\nsetting')
    options = InstructionOptions("spatial", wordings=identity_of(text))

    refusal = find_refusal(get_episode("PickXtimes", "test", 0), options)

    assert "no spatial scenario for it in the pool test" in refusal


def test_a_user_s_phrase_for_the_color_leaves_the_one_for_the_number():
    """The goal of EPISODE is the blue cube, four times. The user's file has `color = "our {color}
    cube"` and no phrase for the number, which is then said as in our words."""
    identity = identity_of(f'{HEAD}[stated.PickXtimes]\ncolor = "our {{color}} cube"\n')

    said = instruct(EPISODE, wordings=identity).text

    assert "our blue cube" in said
    assert "four times" in said


def digest_of(text):
    """Return the digest of what is said in test episodes of PickXtimes with a wording file."""
    return words_digest("PickXtimes", "test", "explicit", identity_of(text))


@pytest.mark.parametrize(
    "text",
    [
        DUSTY.replace("dusty {", "full of dust {"),
        f'{DUSTY}[commands]\nall = ["Do {{color}} {{repeats}}."]\n',
        DUSTY.replace("setting", 'pool = "train"\nsetting'),
        TWO_SENTENCES,
    ],
    ids=["other introduction", "one command more", "for training only", "sentences"],
)
def test_the_digest_of_a_wording_file_changes_with_what_is_said(text):
    """DUSTY has one scenario, *It's dusty on the left …*. Each text says something else: another
    introduction, one command more, the same for training only, or whole sentences. So it has
    another digest than DUSTY and than our words: three different ones."""
    ours = words_digest("PickXtimes", "test")
    assert len({ours, digest_of(DUSTY), digest_of(text)}) == 3


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ('["PickXtimes"]', '["PickXtimes", "SwingXtimes"]'),
        ('["PickXtimes"]', '["PickXtimes", "PickXtimes"]'),
        ("[[scenario]]", '[[scenario]]\nneeds.tasks = ["PickXtimes", "PickXtimes"]'),
    ],
    ids=["one more task", "task named twice", "task needed twice"],
)
def test_the_digest_of_a_wording_file_changes_with_nothing_else(before, after):
    """DUSTY has one scenario of PickXtimes. In each case `after` stands for `before`, which changes
    nothing of what is said in this task: another task, or the same one named twice."""
    assert digest_of(DUSTY.replace(before, after)) == digest_of(DUSTY)


def test_opening_a_wording_file_leaves_the_digest_of_our_words():
    """The digest of our words is asked for before and after a file of two sentences is opened."""
    ours = words_digest("PickXtimes", "test")
    identity_of(TWO_SENTENCES)
    assert words_digest("PickXtimes", "test") == ours


def test_an_instruction_names_the_digest_of_the_words_of_its_wording_file():
    """DUSTY, a user's file, has one scenario of PickXtimes. `words_of` names task, pool and
    digest."""
    identity = identity_of(DUSTY)
    said = instruct(EPISODE, wordings=identity)
    assert said.metadata["words"] == words_of("PickXtimes", "test", wordings=identity)


def test_a_task_that_the_wording_file_lacks_is_refused_with_the_option_to_use():
    """DUSTY, a user's file, has words of PickXtimes only; a run with it has to name that task."""
    identity = identity_of(DUSTY)
    lacking = f"^The wording file {identity} has no words of StopCube; name .*: --tasks PickXtimes"
    with pytest.raises(InvalidValueError, match=lacking):
        instruct(get_episode("StopCube", "test", 0), wordings=identity)


def test_wordings_that_were_never_opened_are_refused():
    """An identity alone does not have the words."""
    with pytest.raises(InvalidValueError, match="are not open"):
        instruct(EPISODE, wordings="gone@00000000")


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        ("name = ", "is not valid TOML"),
        ('name = "a b"\ntasks = ["PickXtimes"]', "has the name 'a b'; it must begin with"),
        ('name = 3\ntasks = ["PickXtimes"]', "name: Expected a text, got a number; it is 3"),
        ('name = "a"', "has no tasks; add a line such as tasks = "),
        ('name = "a"\ntasks = ["PickXTimes"]', "Did you mean 'PickXtimes'?"),
        (
            """
name = "a"
tasks = ["BinFill"]
[[literal]]
task = "BinFill"
when = { colors = ["red"], counts = [1, 2] }
text = "x"
""",
            "literal 1 has when = {'colors': ('red',",
        ),
    ],
    ids=[
        "no TOML",
        "bad name",
        "number as name",
        "no tasks",
        "unknown task",
        "more counts than colors",
    ],
)
def test_a_bad_name_task_or_value_in_a_wording_file_is_refused_in_one_line(text, complaint):
    """Each case is a whole wording file, or its beginning, with one mistake. `check_refusal` checks
    that it is refused in one line that names the file and has the complaint."""
    check_refusal(text, complaint)


def check_refusal(text, complaint):
    """Check that a file is refused in one line that names the file and has the complaint."""
    with pytest.raises(InvalidValueError) as caught:
        parse_wordings(text, "words.toml")
    assert complaint in str(caught.value)
    assert "words.toml" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("lines", "complaint"),
    [
        ("", "has no words of PickXtimes, which stands in its tasks"),
        ("source = 3", "source: Expected a text, got a number; it is 3"),
        ("[comands]", "Did you mean 'commands'?"),
        ("commands = 3", "commands: Expected a table, got a number; it is 3"),
        ("commands.all.test = ['Do {color}.']", "has no commands of PickXtimes in the pool train"),
        ("commands.all = ['Lift <it color: it> {repeats:lap}.']",
         "commands of PickXtimes has other marks than {color} and {repeats}: 'Lift <it color"),
        ("stated.all.color = 'the {person} cube'", "stated color has other marks than"),
        ("stated.all.colour = 'the {colour} brick'",
         "stated.all: There is no field 'colour'; known: color, repeats. Did"),
        ("[[literal]]\ntask = 'PickXtimes'\ntext = 'x'", "literal 1 has no when."),
    ],
)  # fmt: skip
def test_a_bad_command_or_phrase_in_a_wording_file_is_refused_in_one_line(lines, complaint):
    """The lines, with one mistake, follow HEAD, a right beginning with the name and the task
    PickXtimes. `check_refusal` checks that the file is refused in one line that names it and has
    the complaint."""
    check_refusal(HEAD + lines, complaint)


@pytest.mark.parametrize(
    ("when", "text", "complaint"),
    [
        ("color = 'red'", "x",
         "literal 1 has when = {'color': 'red'}; it must have a value for color and repeats"),
        ("color = 'red', repeats = '2'", "x",
         "literal 1, when.repeats: Expected a number, got a text"),
        ("color = 'red', repeats = 1", "lift {color}", "it must be a whole sentence"),
        ("color = 'red', repeats = 1", " ", "has the text ' '; it must be a whole sentence"),
    ],
    ids=["no number", "text as number", "mark in the sentence", "blank sentence"],
)  # fmt: skip
def test_a_bad_sentence_in_a_wording_file_is_refused_in_one_line(when, text, complaint):
    """HEAD is a right beginning with the name and the task PickXtimes. A whole sentence has the
    values of its goal under `when`, color and repeats, and its words under `text`. `check_refusal`
    checks that the file is refused in one line with the complaint."""
    lines = f"[[literal]]\ntask = 'PickXtimes'\nwhen = {{ {when} }}\ntext = '{text}'"

    check_refusal(HEAD + lines, complaint)


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ('"blue"', '"red"', "literal 2 states the goal red, twice of PickXtimes again"),
        ('task = "PickXtimes"', 'task = "StopCube"', "literal 1: There is no task 'StopCube'"),
    ],
    ids=["goal stated twice", "task of no words"],
)
def test_a_sentence_of_a_goal_that_has_one_or_of_another_task_is_refused(before, after, complaint):
    """Each case replaces `before` by `after` in TWO_SENTENCES, a right file with a sentence for the
    red cube, twice, and one for the blue cube, twice. So both are for the red cube, or for a task
    that the file does not name."""
    text = TWO_SENTENCES.replace(before, after)
    with pytest.raises(InvalidValueError, match=complaint):
        parse_wordings(text, "words.toml")


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ("It's", "It's très", "'dusty', introduction has the words"),
        ("It's", "\u00e9" * 3000, "has words of 3,0"),
        ('"spatial"', '"spatail"',
         "'dusty': There is no setting 'spatail'; known: direct, direct-rival, "),
        ('"dusty"', '"\\u001b[31m"', "frame or people has the words"),
        ('["the cube <there place: there>"]', "[]", "has no say.color; "),
        ('["the cube <there place: there>"]',
         '["the cube <there place: there>", "the {color} cube"]',
         "'dusty' has words in say.color that leave different fields open"),
    ],
)  # fmt: skip
def test_a_bad_part_of_a_scenario_in_a_wording_file_is_refused_in_one_line(
    before, after, complaint
):
    """Each case replaces `before` by `after` in DUSTY, a right file with one scenario: *It's dusty
    on the left …* `check_refusal` checks that it is refused in one line with the complaint."""
    assert before in DUSTY
    check_refusal(DUSTY.replace(before, after), complaint)


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("notes = {}", "'dusty': There is no field 'notes'; known: "),
        ('cue.a = "So"', "'dusty': There is no field 'cue.a'; known: "),
        ('lead = ["So ", "Now "]', "lead has the words ['So ', 'Now ']; "),
        ("people.he = []", "'dusty' has fewer than two people; leave people out"),
        ('people.he = ["Leo", "Leo"]', "'dusty' has fewer than two people;"),
        ('list = "colors.0"', "list: There is no slot 'colors.0'; known: color"),
    ],
)
def test_a_bad_line_in_a_scenario_of_a_wording_file_is_refused_in_one_line(line, complaint):
    """DUSTY is a right file that ends with its only scenario, to which the line is added.
    `check_refusal` checks that it is refused in one line with the complaint."""
    check_refusal(DUSTY + line, complaint)


def test_a_remark_that_points_at_no_value_is_refused():
    """In the setting *direct-rival* a remark tells which of two values is meant; *No.* does not."""
    text = """
name = "hand"
tasks = ["PickXtimes"]
[[scenario]]
frame = "dusty"
setting = "direct-rival"
introduction = "It's dusty {place:spot}."
say.color = ["the cube <there place: there>"]
remarks.former = "No. "
remarks.latter = "No. "
remarks.not_former = "No. "
remarks.not_latter = "No. "
"""
    check_refusal(text, "'dusty' has a remark that points at nothing")


@pytest.mark.parametrize("pool_of_the_second", ["", 'pool = "test"\n'])
def test_two_scenarios_of_one_name_and_pool_are_refused(pool_of_the_second):
    """DUSTY has one scenario, "dusty", without a pool, so that it serves both. A second one of this
    name, for both pools or for tests, is not to be told from it in tests."""
    second = DUSTY.removeprefix(f"\n{HEAD}").replace("setting", f"{pool_of_the_second}setting")
    check_refusal(DUSTY + second, "'dusty' stands twice in the setting spatial, test.")


def test_an_empty_table_of_commands_is_refused_and_not_filled_with_ours():
    """DUSTY is a right file; with an empty table of commands it could be one that is not
    finished."""
    with pytest.raises(InvalidValueError, match="no commands of PickXtimes in the pool train"):
        parse_wordings(f"{DUSTY}[commands.PickXtimes]\n", "words.toml")


def test_a_competing_remark_names_no_color_of_the_list_that_was_introduced():
    """The scene has a red, a green and a blue cube, of which blue is meant. The story introduces a
    list of two colors, which must include blue. A competing remark is about a color that is not
    wanted; it must be none of the list, so all five remarks are about the red cube."""
    identity = identity_of("""
name = "hand"
tasks = ["PickXtimes"]
[[scenario]]
frame = "paint"
setting = "direct"
list = "color"
needs.list = [2]
introduction = "We painted a {list.0} and a {list.1} cube."
reinforcement = "It is new."
distractors = ["I still have to wash the brushes."]
competing = ["The {rival color} one comes next week."]
cue = "So let's go."
lead = "I need <rank color: {rank}>, so "
say.color = ["<it color: it>"]
""")
    episode = get_episode("PickXtimes", "test", 3)

    said = instruct(episode, "contextual", wordings=identity, distractor="competing", distractors=5)

    assert said.turns[0] == "We painted a blue and a green cube."
    assert said.text.count("The red one comes next week.") == 5


@pytest.mark.parametrize(
    "wrong",
    [
        "".join(f"a{number} = 1\n" for number in range(5000)),
        'introduction = "' + "x" * 500_000 + '"',
        'needs = { "' + "x" * 500_000 + '" = 1 }',
        "[[scenario]]\n" * 5000,
    ],
    ids=["5000 unknown fields", "a long text", "a long name of a field", "5000 empty scenarios"],
)
def test_error_messages_about_a_huge_file_stay_short(wrong):
    """The file has a scenario with a name of 200,000 characters, and a mistake that is repeated
    5,000 times or 500,000 characters long. Its error may have 2,000 characters in a line, and
    10,000 in all."""
    text = f'{HEAD}[[scenario]]\nframe = "{"A" * 200_000}"\nsetting = "direct"\n{wrong}'
    with pytest.raises(InvalidValueError) as caught:
        parse_wordings(text, "words.toml")
    assert len(str(caught.value)) < 10_000
    assert max(map(len, str(caught.value).splitlines())) <= 2_000


def test_a_byte_order_mark_does_not_change_the_identity_of_a_file(tmp_path):
    """Editors on Windows add such a mark to the beginning of a text file. The same file is written
    without it and with it ("utf-8-sig"); the words, and so the identity, are the same."""
    path = tmp_path / "words.toml"
    path.write_text(TWO_SENTENCES)
    usual = open_wordings(path)

    path.write_text(TWO_SENTENCES, encoding="utf-8-sig")

    assert open_wordings(path) == usual


@pytest.mark.parametrize(
    "amounts",
    [
        'colors = ["red", "green"], counts = [3, 1]',
        'colors = ["green", "red"], counts = [1, 3]',
    ],
)
def test_a_sentence_for_amounts_is_found_whatever_the_order_of_its_colors(amounts):
    """The goal of the episode is three red cubes and one green cube. A user's file has a sentence
    for this goal, with the amounts in this order or the other one."""
    episode = get_episode("BinFill", "test", 3)
    identity = identity_of(f"""
name = "bin"
tasks = ["BinFill"]
[[literal]]
task = "BinFill"
when = {{ {amounts} }}
text = "fill it"
""")

    said = instruct(episode, wordings=identity)

    assert said.text == "fill it"
    assert understood_goals(said, episode) == (Goal.of(colors=("red", "green"), counts=(3, 1)),)


@pytest.mark.parametrize(
    ("command", "begun"),
    [
        ("I'd like {color} there {repeats}.", "So I'd like it"),
        ("I need {color} there {repeats}.", "So I need it"),
        ("LEDs on, lift {color} {repeats}.", "So LEDs on, lift it"),
        ("A lift of {color}, {repeats}.", "So a lift of it"),
        ("If you can, lift {color} {repeats}.", "So if you can, lift it"),
    ],
)
def test_so_before_a_command_lowers_its_first_letter_except_in_i_and_leds(command, begun):
    """PAINT has one scenario with the line `lead = "So "`, which stands before the command of the
    file; the blue cube is said as *it*."""
    identity = identity_of(f'{PAINT}[commands]\nall = ["{command}"]\n')
    assert instruct(EPISODE, "direct", wordings=identity).command.startswith(begun)


@pytest.mark.parametrize(
    ("before", "after", "goals_left", "hidden"),
    [
        ("it>", "it>", 3, 1),
        ("it>", "it>, the {color} one,", 1, 0),
        ('lead = "So "', 'lead = "Take the {color} one: "', 1, 0),
    ],
    ids=["it", "it, the blue one", "take the blue one: it"],
)
def test_a_command_that_names_the_color_leaves_one_goal_even_if_it_also_says_it(
    before, after, goals_left, hidden
):
    """PAINT has one scenario, whose command begins *So* and says *it*; the goal is the blue of
    three cubes. With *it* alone the command leaves three colors open, and one value is hidden. If
    `after` takes the place of `before`, the command names the color, too: one goal is left, none is
    hidden."""
    text = PAINT.replace(before, after)

    said = instruct(EPISODE, "direct", wordings=identity_of(text))

    assert len(command_goals(said.meaning, EPISODE)) == goals_left
    assert said.metadata["hidden_slots"] == hidden


@pytest.mark.parametrize("setting", ["explicit", "direct"])
@pytest.mark.parametrize("task", ["PickXtimes", "BinFill", "VideoUnmask"])
def test_the_declared_meaning_lists_values_in_the_order_of_the_goal(task, setting):
    """The meaning that an instruction declares has the values of the goal by their fields: color,
    then repeats, even if the words say the number first."""
    episode = get_episode(task, "test", 3)
    fields = [value.field for value in values_of_goal(episode.goal)]
    assert list(instruct(episode, setting).meaning.terms) == fields


@pytest.mark.parametrize(
    ("before", "after", "mark"),
    [
        ("We painted", "{excluded} went. We painted", "'excluded'"),
        ('["<it color: it>"]', '["{rank}, <it color: it>"]', "'rank'"),
    ],
)
def test_a_scenario_with_a_mark_that_has_no_value_is_refused_by_file_and_name(before, after, mark):
    """PAINT has one scenario, *We painted the blue cube …*. In each case it gets a mark that needs
    what it does not have: `{excluded}` a rule that excludes colors, and `{rank}` a list."""
    identity = identity_of(PAINT.replace(before, after))
    with pytest.raises(InvalidValueError, match=f"^words.toml, scenario 'paint', lacks {mark}"):
        instruct(EPISODE, "direct", wordings=identity)


def test_a_competing_remark_with_a_mark_that_has_no_value_is_refused():
    """PAINT has one scenario, *We painted the blue cube …*. Its competing remark, about a color
    that is not wanted, gets the mark `{list}`, which needs a list."""
    identity = identity_of(PAINT.replace("{rival color} one", "{rival color} one {list}"))
    lacking = "^words.toml, scenario 'paint', lacks a competing remark with"
    with pytest.raises(InvalidValueError, match=lacking):
        instruct(
            EPISODE, "contextual", wordings=identity, stages=(1, 2, 3, 5), distractor="competing"
        )


def test_a_scenario_that_lists_values_of_another_task_fits_no_episode():
    """PAINT has one scenario, *We painted the blue cube …*. Here its file also serves StopCube, and
    it lists visits, which only StopCube has; so it does not fit an episode of PickXtimes."""
    text = PAINT.replace('"PickXtimes"', '"PickXtimes", "StopCube"')
    options = InstructionOptions("direct", wordings=identity_of(f'{text}list = "visit"\n'))

    assert "has no direct scenario for it in the pool test" in find_refusal(EPISODE, options)


pieces_of_files = st.sampled_from(
    [
        *re.split(r"(\s|[\[\]{}=.,])", TWO_SENTENCES + DUSTY),
        "[[",
        "{a=",
        "\0",
        "\x1b",
        "é",
        "9" * 5000,
    ]
)
texts_of_pieces = st.lists(st.one_of(pieces_of_files, st.text(max_size=3)), max_size=40)


@given(pieces=texts_of_pieces)
def test_any_text_is_read_as_a_wording_file_or_refused(pieces):
    """Up to 40 pieces of real files, and of strange characters, in random order: no error but the
    refusal may come out."""
    with contextlib.suppress(InvalidValueError):
        parse_wordings(HEAD + "".join(pieces), "words.toml")


@pytest.mark.parametrize("name", ["missing.toml", "nul\0.toml", "bytes.toml", ""])
def test_a_missing_or_binary_wording_file_is_refused(tmp_path, name):
    """An empty name is that of the folder."""
    (tmp_path / "bytes.toml").write_bytes(b"\xff")
    with pytest.raises(InvalidValueError, match="cannot be read"):
        read_wordings(tmp_path / name)


def write_changed(path):
    """Write a wording file, open it and change it: *lift* becomes *take*. Return its identity."""
    path.write_text(TWO_SENTENCES)
    identity = open_wordings(path)
    path.write_text(TWO_SENTENCES.replace("lift", "take"))
    return identity


def test_a_wording_file_has_another_identity_after_a_change(tmp_path):
    """Its sentences said *lift*, and now say *take*."""
    before = write_changed(tmp_path / "words.toml")

    assert open_wordings(tmp_path / "words.toml") != before


def test_what_was_open_once_stays_open_in_this_process(tmp_path):
    """Episodes that need the earlier words can still be said, though the file has changed."""
    before = write_changed(tmp_path / "words.toml")

    assert open_wordings(tmp_path / "words.toml", before) == before


def test_a_wording_file_that_changed_no_longer_serves_episodes_of_its_old_version(tmp_path):
    """The words "hand@00000000" were never open in this process."""
    path = tmp_path / "words.toml"
    path.write_text(TWO_SENTENCES)

    with pytest.raises(InvalidValueError, match="but the episodes need hand@00000000"):
        open_wordings(path, "hand@00000000")


def test_open_wordings_may_be_named_by_their_identity():
    """Instead of the path of their file. Episodes that need other words are still refused."""
    identity = identity_of(TWO_SENTENCES)

    assert open_wordings(identity) == identity
    with pytest.raises(InvalidValueError, match="but the episodes need hand@00000000"):
        open_wordings(identity, "hand@00000000")


def test_episodes_of_a_user_s_words_need_their_file():
    """`open_wordings(None, …)` is a run without `--wordings` that continues one with such words."""
    with pytest.raises(InvalidValueError, match="need their file; none was given"):
        open_wordings(None, "hand@00000000")


def test_episodes_of_our_words_need_no_file():
    """None stands for our words."""
    assert open_wordings(None) is None
