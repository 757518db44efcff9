"""Scenarios from data files, and the checker for their authors."""

import difflib
import itertools
import json
import re
import tomllib
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import pytest
from wording_stand_ins import WOBBLY, take_words

from roboirg.apps.language_lab.scenarios.leaks import find_leaks
from roboirg.apps.language_lab.scenarios.scenario_check import (
    check_scenarios,
    scenes_of,
    unserved_settings,
)
from roboirg.apps.language_lab.scenarios.scenario_report import report_lines
from roboirg.apps.language_lab.scenarios.sentence_rules import broken_sentences, literal
from roboirg.core.episode import SPLITS, Goal
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.motions import Swap
from roboirg.core.word_pools import POOLS
from roboirg.language import LANGUAGE_VERSION, instruct, instruct_with
from roboirg.language.arms import say_arm
from roboirg.language.generator import find_refusal, request_of, spoken_instruction
from roboirg.language.instruction import Instruction, Mention, Utterance
from roboirg.language.number_words import cardinal
from roboirg.language.scenarios.choice import choose
from roboirg.language.scenarios.scenario_file import (
    FOLDER,
    pointer_table,
    read_task_scenarios,
    task_scenarios,
    written_words,
)
from roboirg.language.scenarios.spoken import say_chosen
from roboirg.language.scenarios.wording_file import parse_wordings
from roboirg.language.settings import all_settings, settings_of
from roboirg.language.token_counts import tokens_of
from roboirg.language.variants import expressible_options, instructions
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode, split_episodes

WRITTEN = [*written_words()]
DOCS = Path(__file__).parents[2] / "docs"
USER_FILE_OF_THE_PAGE, SPATIAL_FILE_OF_THE_PAGE = re.findall(
    r"```toml\n(.*?)```", (DOCS / "add-scenario.md").read_text(), re.DOTALL
)
"""The page's examples: a file of a user's own, and two spatial scenarios."""
BIRTHDAY = USER_FILE_OF_THE_PAGE.replace('name = "mine"\n', "").replace(
    "setting", 'pool = "train"\nsetting'
)
"""The first one as a file of ours."""
TWO_CUBES = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "two"
pool = "test"
setting = "direct-rival"
list = "color"
introduction = "We have the {list.0} cube, and they still sell the {list.1} one."
say.color = ["<it color: it>"]
remarks.former = "Do <former list.0: the former>: "
remarks.latter = "Do <latter list.1: the latter>: "
remarks.not_former = "Not <former list.0: the former>: "
remarks.not_latter = "Not <latter list.1: the latter>: "
"""
FEWER = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "fewer"
pool = "train"
setting = "reasoning"
derive.pattern = "number deduction"
derive.relations = ["two fewer"]
introduction = "{person} needs {reference:photo}, and I took {step}."
say.repeats = ["<each reference: [repeats: for the photo|once for each photo]>"]
"""
PHOTOS = "[repeats: for the photo|once for each photo]"
NOTHING_TO_SEE = "nothing to see in this scene singles out a slot's value"
NO_SECOND_VALUE = "a goal that counts cubes of several colors leaves no rival"
YEARS = "[repeats: once for that year|once for each year]"


def read_scenario_file(text, task="PickXtimes"):
    """Return what a file says of a task."""
    return read_task_scenarios(text, "mine.toml")[task]


def some_instructions_of(task):
    """Yield a few episodes of both pools with every option that can express them."""
    for split, index in itertools.product(("train", "test"), range(8)):
        episode = get_episode(task, split, index)
        for options in expressible_options(episode):
            yield episode, options, instruct_with(episode, options)


@pytest.mark.parametrize(
    ("before", "after", "complaint"),
    [
        ("{repeats} today", "{repeat} today", "introduction: There is no slot 'repeat'; known: "),
        (
            "<it color: it>.",
            "<it color: that thing>.",
            "<it color: that thing>, which does not exist; the nearest for a color: <that",
        ),
        (
            "<it color: it>.",
            "<them color: it>.",
            "<them color: it>; in pointers.toml these words have the class 'it' for a color.",
        ),
        (
            f"<each repeats: {YEARS}>",
            f"<it repeats: {YEARS}>",
            f"{YEARS}>; in pointers.toml these words have the class 'each' for a number.",
        ),
        ("<it color: it>.", "<it color it>.", "has a bracket that is no mark"),
        ("\ncue = ", "\nclue = ", "'birthday': There is no field 'clue'; known: competing, cue,"),
        (
            '\ncue = "Let\'s surprise {him} with the cube."',
            "",
            "'birthday' has no cue; direct needs introduction, reinf",
        ),
        (
            "say.color",
            "say.colour",
            "'birthday': There is no field 'say.colour'; known: competing, cue, ",
        ),
        ('pool = "train"', 'pool = "dev"', "'birthday', pool is 'dev'; it must be train or test."),
        ('pool = "train"\n', "", "'birthday' has no pool."),
        ('pool = "train"\n', 'pool = "train"\npeople.he = [5]\n', "people: Expected a text, got"),
        (
            'introduction = "',
            'introduction = 5\nlead = "',
            "introduction has the words 5; they must",
        ),
        ('"{he}', '"\u2019{he}', "must be printable ASCII"),
        ("[[scenario]]", "[[scenario", "(at line 3, column 11)"),
        ('["PickXtimes"]', "[]", "has no tasks; add a line such as tasks = "),
        ('["PickXtimes"]', '["Juggle"]', "There is no task 'Juggle'; known: "),
        (
            "[[scenario]]",
            '[commands.StopCube]\ntrain = ["Go."]\n[[scenario]]',
            "'StopCube'; known: PickXtimes, all.",
        ),
        (
            "[[scenario]]",
            '[commands.all]\ntrain = ["Go."]\n[[scenario]]',
            "has no commands of PickXtimes in the pool test.",
        ),
        (
            "[[scenario]]",
            '[commands.all]\ntrain = ["Put {colour} {repeats}."]\n[[scenario]]',
            "commands of PickXtimes has other marks than {color} and {repeats}: 'Put {colour} ",
        ),
        (
            'pool = "train"\n',
            'pool = "train"\nneeds.tasks = ["StopCube"]\n',
            "'birthday', needs.tasks: There is no task 'StopCube'; known: PickXtimes.",
        ),
    ],
)
def test_a_mistake_in_a_scenario_file_is_reported_with_file_scenario_and_field(
    before, after, complaint
):
    """A scenario is a little story around a command; `<it color: it>` marks a word that
    refers back to a color, and the table pointers.toml lists all words that may."""
    assert before in BIRTHDAY
    with pytest.raises(InvalidValueError, match=r"^mine\.toml") as found:
        read_scenario_file(BIRTHDAY.replace(before, after))
    assert complaint in str(found.value)


FEWER_THAN_HE_DID = "{step} fewer [step: time|times] than <that reference: {he} did>"


def test_an_unknown_pointer_is_refused_with_the_five_nearest_known_ones():
    """A pointer is a word that refers back, with what it refers to: `<that reference: that>`."""
    with pytest.raises(InvalidValueError) as found:
        read_scenario_file(BIRTHDAY.replace('["<it color: it>"]', f'["{FEWER_THAN_HE_DID}"]'))

    nearest = re.search("for a reference: (.*) .* is any noun", str(found.value))[1].split("; ")
    assert len(nearest) == len(set(nearest)) == 5
    assert "{step:*} fewer than <that reference: that>" in nearest


def pointer_lines():
    """Return the lines of the page's table: types, operation, and words by their class."""
    cells = defaultdict(lambda: defaultdict(dict))
    for row in pointer_table():
        for kind in row.of:
            cells[kind, row.operation][row.kind][f"`{row.words}`".replace("|", "\\|")] = None
    kinds = defaultdict(list)
    for (kind, operation), classes in cells.items():
        words = [f"**{name}** {', '.join(words)}" for name, words in classes.items()]
        kinds[operation, "; ".join(words)].append(kind)
    lines = [f"| {', '.join(names)} | {how} | {words} |" for (how, words), names in kinds.items()]
    return sorted(lines)


def test_the_documentation_lists_every_pointer_of_the_table():
    """A pointer is a word that refers back to something
    said before, such as *it* or *the latter*."""
    lines = (DOCS / "scenario-marks.md").read_text().splitlines()
    table = lines[lines.index("| stands for | follows by | words |") + 2 :]
    assert sorted(table) == pointer_lines()


def test_all_mistakes_of_a_scenario_file_are_reported_at_once():
    """Five mistakes in the scenario 'birthday', and two more in one that also stands twice."""
    wrong = BIRTHDAY.replace('"train"', '"dev"').replace("\ncue", "\nclue")
    wrong = wrong.replace("{repeats} today", "{repeat} today").replace("{color} c", "{colr} c")
    wrong = wrong.replace("<it color: it>.", "<them color: it>")
    again = TWO_CUBES.replace("not_latter", "latest").partition("\n[")[2]

    with pytest.raises(InvalidValueError) as found:
        read_task_scenarios(f"{wrong}\n[{again}\n[{again}", "mine.toml")

    named = [line.removeprefix("mine.toml, scenario ") for line in str(found.value).splitlines()]
    begun = [
        "'birthday', pool is",
        "'birthday': There is no field 'clue'",
        "'birthday', introduction: There is no slot 'repeat'",
        "'birthday', introduction: There is no slot 'colr'",
        "'birthday', reinforcement has the pointer <them color: it>",
        "'two': There is no field 'remarks.latest'",
        "'two' has no remarks.not_latter",
        "'two' stands twice in the setting direct-rival, test.",
    ]
    assert [line[: len(beginning)] for line, beginning in zip(named, begun, strict=True)] == begun


@pytest.mark.parametrize(
    ("text", "before", "after", "rule"),
    [
        (BIRTHDAY, "turns {repeats} today and ", "", "points at what the"),
        (BIRTHDAY, "wants to", "has a {color} one and wants to", "has 2 antecedents"),
        (BIRTHDAY, "Let's surprise", "You saw this. Surprise", "what was seen is not checked"),
        (BIRTHDAY, "The cake", "The second cake", "names second, which could be a value"),
        (BIRTHDAY, "The cake", "Look at that cake", "may be covered"),
        (BIRTHDAY, 'say.color = ["', 'lead = "Twice: "\nsay.color = ["', "names twice"),
        (BIRTHDAY, 'say.color = ["', 'lead = "Twice: "\nsay.color = ["', "gives away twice"),
        (BIRTHDAY, "The cake", "The cake " + "is so very good " * 9, "only 64 are heard"),
        (BIRTHDAY, "{rival color} one", "{rival color} one {list}",
         "a competing remark with a value for list or rival color in this"),
        (BIRTHDAY, "{rival color}", "{rival visit}", "known: aside.0"),
        (TWO_CUBES, "Not <former list.0: the", "Not <latter list.1: the",
         "the class 'former' for a"),
        (TWO_CUBES, "Do <former list.0: the former>", "Do <latter list.1: the latter>",
         "first point"),
        (FEWER, PHOTOS, "once for each of them", "say.repeats must stand"),
        (FEWER, " {reference:photo}", "", "says the same of another goal"),
        (FEWER, "once for each", "once per", "which does not exist"),
        *((BIRTHDAY, "The cake", f"{words}, the cake", f"names {words.lower()}")
          for words in ("Twice", "On the left", "Once", "Four")),
    ],
)  # fmt: skip
def test_the_checker_for_authors_names_the_rule_that_a_scenario_breaks(text, before, after, rule):
    """Each case takes a scenario without a fault and replaces `before` by `after`."""
    scenes = scenes_of("PickXtimes", 0)[::10]
    assert not check_scenarios(read_scenario_file(text), None, scenes)[0].broken
    assert before in text

    try:
        words = read_scenario_file(text.replace(before, after))
        broken = list(check_scenarios(words, None, scenes)[0].broken)
    except InvalidValueError as error:  # said no expression of the table
        broken = [str(error)]
    assert any(rule in sentence for sentence in broken), broken


def test_a_value_or_place_of_the_goal_in_the_command_is_found_as_a_leak():
    """A command that refers back must not name what the introduction has said.

    *First* and *other* refer back and are no leak; *red* and *at the far left* are values.
    """
    command = "Lift the first cube, then the other red cube at the far left."
    pointers = [
        Mention(0, command.index(word), command.index(word) + 5, "anaphor", word, "colors", "red")
        for word in ("first", "other")
    ]

    said = Instruction(
        *("VideoUnmask", "VideoUnmask/test/3", "direct", "implicit"),
        (Utterance("command", command),),
        tuple(pointers),
        {"landmarks": ["at the far left", "closest to you"]},
    )

    assert find_leaks(said, Goal.of(colors=("green", "red"))) == {"red", "at the far left"}
    assert find_leaks(said, Goal.of(visit=1)) == {"at the far left"}


def test_the_word_one_is_a_leak_only_where_it_is_a_number():
    """A leak is a value of the goal that the command names instead of referring back to it."""
    said = instruct(get_episode("PickXtimes", "test", 3), "direct")
    for words, leaks in {
        "Lift the one before that one.": set(),
        "Move it over both targets.": set(),
        "Lift it one time.": {"one"},
    }.items():
        command = replace(said.utterances[-1], text=words)
        telling = replace(said, utterances=(*said.utterances[:-1], command), mentions=())
        assert find_leaks(telling, Goal.of(color="red", repeats=1)) == leaks


@pytest.mark.parametrize(("text", "setting"), [(BIRTHDAY, "direct"), (FEWER, "reasoning")])
def test_adding_a_scenario_changes_only_the_episodes_that_choose_it(text, setting):
    """Each episode draws one of the scenarios that fit; a new one must not redraw all others."""
    (added,) = read_scenario_file(text).scenarios
    ours = [
        scenario
        for scenario in task_scenarios("PickXtimes").scenarios
        if scenario.fields.setting == setting
    ]
    known = [scenario for scenario in ours if scenario.fields.pool == "train"]
    told = 0

    for episode in scenes_of("PickXtimes", 0):
        request = request_of(episode, InstructionOptions(setting, wordings="train"))
        before = choose(request, setting, known)
        after = choose(request, setting, [*known, added])
        told += after.scenario is added
        assert after == before or after.scenario is added

    assert 3 < told < 60


def test_the_example_scenario_of_the_documentation_breaks_no_rule():
    (report,) = check_scenarios(read_scenario_file(BIRTHDAY), None, scenes_of("PickXtimes"))
    assert not report.broken


def test_the_example_file_of_the_documentation_has_a_scenario_for_every_scene():
    scenes = scenes_of("PickXtimes", 0)[::4]
    words = parse_wordings(USER_FILE_OF_THE_PAGE + SPATIAL_FILE_OF_THE_PAGE, "mine.toml").tasks[
        "PickXtimes"
    ]

    reports = check_scenarios(words, None, scenes)

    assert [report.scenario.fields.frame for report in reports if report.broken] == []
    assert len(reports) == 3
    assert not list(unserved_settings(reports, scenes, Path("mine.toml")))


@pytest.mark.parametrize(
    ("text", "before", "after", "reason"),
    [
        (FEWER, "two fewer", "nine fewer", "the goal follows in no way that setting, say, list"),
        (WOBBLY, "{place:spot}", "{clue}", "nothing has the place or clue that the introduction"),
        (WOBBLY, "{place:spot}", "{place.1}", "nothing has the place or clue that the introd"),
    ],
)
def test_a_scenario_that_fits_no_scene_is_reported_with_the_reason(text, before, after, reason):
    """No goal is reached by *nine fewer*, and no cube has a clue or a second place."""
    scenes = scenes_of("PickXtimes", 0)[:3]
    (report,) = check_scenarios(read_scenario_file(text.replace(before, after)), None, scenes)

    fits_none = f"fits none of the scenes; in PickXtimes/train/0 {reason}"

    assert [rule[: len(fits_none)] for rule in report.broken][-1:] == [fits_none]


def test_the_report_for_authors_shows_a_competing_remark_if_the_setting_has_one():
    """A competing remark is a distraction about a color that is not wanted."""
    scenes = scenes_of("PickXtimes", 0)[::20]
    for text, number in ((BIRTHDAY, 1), (TWO_CUBES, 0)):
        (report,) = check_scenarios(read_scenario_file(text), None, scenes)
        (*texts, _, _) = report_lines(report, "PickXtimes")
        shown = [text for text in texts if text.startswith("  With a competing remark: ")]
        assert len(shown) == number
        assert all(" one. Let's surprise" in text for text in shown)


CONTAINER_FILE = """
tasks = ["VideoUnmask"]
[[scenario]]
frame = "two for us"
pool = "train"
setting = "reasoning"
derive.pattern = "contextual logic"
list = "colors"
needs.colors = [1]
introduction = "The {list} cubes are for us, and {person} has picked the {taken} one."
say."colors.0" = ["WORDS"]
"""


@pytest.mark.parametrize(
    ("words", "is_broken"),
    [
        ("the container over <other colors.0: the other one>", False),
        ("the one over <other colors.0: mine>", False),
        ("<other colors.0: the other one>", True),
    ],
)
def test_a_command_to_lift_the_cube_instead_of_its_container_is_a_broken_rule(words, is_broken):
    """*Lift the other one* would mean the cube, which nobody can lift through its container."""
    scenario = read_scenario_file(CONTAINER_FILE.replace("WORDS", words), "VideoUnmask").scenarios[
        0
    ]
    broken = any(
        "a container is lifted" in sentence for sentence in broken_sentences(scenario, "container")
    )
    assert broken == is_broken


def test_a_text_that_is_too_long_only_when_it_names_everything_is_reported():
    """The form *resolved* names all values again and so is longer than the usual one."""
    longer = "<it color: it> is much prettier than {person.2}'s {rival color} one."
    text = BIRTHDAY.replace("{person.2} has a {rival color} one.", longer)
    (report,) = check_scenarios(read_scenario_file(text), None, scenes_of("PickXtimes"))

    (*_, complaint, example, _) = report_lines(report, "PickXtimes")

    assert re.match(r"  BROKEN needs \d+ tokens; only 64 are heard", complaint)
    assert re.match(r"    resolved: .*Pick up the \w+ cube and put it on the target", example)


def test_right_now_at_once_and_a_second_are_not_taken_for_values():
    """The checker refuses words that could be a value of the goal, such as *right* or *once*."""
    words = (
        "All right, right now it's left at home. Once we're done, at once. Just a second, the cake"
    )
    text = BIRTHDAY.replace("The cake", words).replace("{person} turns", "My cat turns")
    text = text.replace("{he}", "it").replace("surprise {him}", "surprise it")
    scenes = scenes_of("PickXtimes", 0)[::20]

    (report,) = check_scenarios(read_scenario_file(text), None, scenes)

    assert not set(report.broken) - {f"needs {tokens_of(report.longest)} tokens; only 64 are heard"}


@pytest.mark.parametrize("task", WRITTEN)
@pytest.mark.parametrize("step", [25, pytest.param(1, marks=pytest.mark.slow)])
def test_none_of_our_scenarios_breaks_a_rule(task, step):
    """In a sample of scenes (`step` > 1) a scenario may find none that it fits."""
    reports = check_scenarios(task_scenarios(task), None, scenes_of(task)[::step])
    broken = {
        report.scenario.fields.frame: dict(report.broken) for report in reports if report.broken
    }
    assert step > 1 or not broken

    rules = {rule.partition(";")[0] for found in broken.values() for rule in found}
    assert rules <= {"fits none of the scenes"}, broken


@pytest.mark.parametrize("task", WRITTEN)
def test_every_published_scene_can_be_commanded_in_every_setting_and_pool(task):
    """A pool is a set of wordings, for training or for tests. Two settings may refuse a scene."""
    for episode, name, pool in itertools.product(scenes_of(task, 0), all_settings(), POOLS):
        if name in settings_of(get_task(task)):
            refused = find_refusal(episode, InstructionOptions(name, wordings=pool))
            known = {"grounded": (None, NOTHING_TO_SEE), "direct-rival": (None, NO_SECOND_VALUE)}
            assert refused in known.get(name, (None,)), (episode.key, name, pool)


def test_a_story_does_not_speak_of_several_cubes_if_one_goes_into_the_bin():
    """*I need more cubes like the one on the left. So
    put one like that one into the bin.*"""
    single = 0
    for episode in split_episodes(["BinFill"], SPLITS):
        options = InstructionOptions("spatial", wordings="train")
        if find_refusal(episode, options) is None:
            told = instruct_with(episode, options)
            first, _, command = told.text.partition(". ")
            if re.search(r"\bone (like|of) that", command):
                assert not re.search(r"I\b.* cubes|My mom wants cubes", first), told.text
                single += 1
    assert single


@pytest.mark.parametrize("task", WRITTEN)
def test_all_instructions_are_clean_text_with_consistent_metadata(task):
    """Also: an instruction is the same when asked for again, a contextual one without context
    is a direct one, and the form that names all values ends with the explicit command."""
    commands = {}
    for episode, options, told in some_instructions_of(task):
        notes = told.metadata
        assert notes["language_version"] == LANGUAGE_VERSION
        assert json.loads(json.dumps(notes)) == dict(notes)
        assert notes.keys() - {"scenario"} == instruct(episode).metadata.keys()
        assert (notes["frame"] is not None) == (options.setting == "spatial")
        assert told == instruct_with(episode, options)
        assert not re.search(r"[{}<>|\[\]]|  | [.,]|[.]{2}", told.text), told.text
        for mention in told.mentions:
            assert told.span(mention).strip() == told.span(mention) != ""
        if options.setting == "contextual" and options.stages == (1, 5):
            direct = replace(options, setting="direct")
            assert told.turns == instruct_with(episode, direct).turns
        if options.setting == "explicit":
            commands[episode.key] = told.command
        if (options.setting, options.form) == ("direct", "resolved"):
            own = commands[episode.key]
            assert told.command.lower().endswith(own.lower())


@pytest.mark.parametrize("name", ["spatial", "grounded", "reasoning"])
def test_of_two_containers_only_one_has_to_be_found_out(name):
    """The other one's color is named once more than the first one's, or alone."""
    found = 0
    for index, pool in itertools.product(range(60), POOLS):
        episode = get_episode("VideoUnmask", "random", index)
        options = InstructionOptions(name, wordings=pool)
        if len(episode.goal["colors"]) < 2 or find_refusal(episode, options) is not None:
            continue
        found += 1
        said = instruct_with(episode, options)
        named = re.findall("red|green|blue", said.turns[0])
        counts = sorted(named.count(color) for color in episode.goal["colors"])
        assert counts == ([1, 2] if name == "reasoning" else [0, 1]), said.text
        assert len(named) == sum(counts)
        assert not re.search("red|green|blue", said.turns[-1])
    assert found


@pytest.mark.parametrize("name", ["spatial", "grounded"])
def test_of_several_amounts_only_the_color_of_one_has_to_be_found_out(name):
    """*Two red cubes, and one like the one on the left*: the rest of the goal is stated."""
    hidden = defaultdict(set)
    for index, pool in itertools.product(range(120), POOLS):
        episode = get_episode("BinFill", "random", index)
        colors = list(episode.goal["colors"])
        options = InstructionOptions(name, wordings=pool)
        if len(colors) < 2 or find_refusal(episode, options) is not None:
            continue
        said = instruct_with(episode, options)
        stated = re.findall(r"(\w+) (red|green|blue) cube", said.turns[1])
        amounts = {(cardinal(count), color) for color, count in episode.goal.amounts}
        assert set(stated) < amounts, said.text
        assert len(stated) == len(amounts) - 1
        assert said.metadata["hidden_slots"] == 1
        (color,) = set(colors) - {color for _, color in stated}
        hidden[len(colors)].add(colors.index(color))

    # That it is found out says nothing about its place among the goal's colors.
    assert hidden[2] == {0, 1}


def test_three_amounts_are_said_in_one_phrase_with_a_mention_for_each_value():
    """A mention marks the span of the text that stands for a value of the goal."""
    scenes = scenes_of("BinFill", 0)
    episode = next(scene for scene in scenes if len(scene.goal["colors"]) == 3)
    said = instruct(episode)
    assert re.search(r"\w+ red cubes?, \w+ blue ones? and \w+ green ones? ", said.text)

    values = [mention.value for mention in said.mentions]
    assert values == [value for color, count in episode.goal.amounts for value in (count, color)]


def test_a_clue_that_excludes_two_objects_mentions_these_in_a_sentence_first():
    """A clue says what can be seen of the right object, in part by what it is not."""
    for index in range(60):
        episode = get_episode("PickXtimes", "random", index)
        options = InstructionOptions("grounded")
        if find_refusal(episode, options) is None:
            said = instruct_with(episode, options)
            named = replace(options, form="resolved")
            aside = said.metadata["pattern"] == "sets"
            assert (said.turns[0].count(".") == 2) == aside, said.text
            assert ("neither" in instruct_with(episode, named).command) == aside


@pytest.mark.parametrize("kind", ["neutral", "competing"])
def test_a_context_of_nine_remarks_begins_with_those_of_a_context_of_two(kind):
    """A dialogue has four turns besides its remarks: two before them, and two after them."""
    episode = get_episode("PickXtimes", "train", 2)
    few, many = (
        instruct(episode, "contextual", distractor=kind, distractors=number).turns
        for number in (2, 9)
    )
    assert (many[:4], many[-2:], len(many)) == (few[:4], few[-2:], 13)


def test_each_control_run_of_an_episode_says_different_words():
    """Controls are other words for the same goal, another goal, or the words in random order."""
    episode = get_episode("PickXtimes", "train", 2)
    options = InstructionOptions("direct")
    told = instruct_with(episode, options).text

    arms = [say_arm(episode, options, arm) for arm in ("paraphrase-1", "other-goal", "scrambled")]

    assert len({told, *(arm.instruction.text for arm in arms)}) == 4


def test_a_task_without_a_file_of_words_is_refused_by_name(monkeypatch):
    take_words(monkeypatch, "VideoRepick")
    lacking = "has no commands of VideoRepick in the pool train."

    with pytest.raises(InvalidValueError, match=lacking):
        read_scenario_file(BIRTHDAY.replace("PickXtimes", "VideoRepick"))
    with pytest.raises(InvalidValueError, match="VideoRepick names no file of words"):
        instruct(get_episode("VideoRepick", "test", 0), "direct")


FILE_FOR_TWO_TASKS = """
tasks = ["PickXtimes", "SwingXtimes"]
[commands.all]
train = ["Move {color} {repeats}."]
test = ["Take {color} {repeats}."]
[commands.SwingXtimes]
test = ["Swing {color} {repeats}."]
[stated.all]
color = "the {color} cube"
repeats = "{repeats:times}"
[stated.SwingXtimes]
repeats = "for {repeats:lap}"
[[scenario]]
frame = "here"
pool = "test"
setting = "spatial"
introduction = "Dust it {place:spot}."
say.color = ["the cube <there place: there>"]
[[scenario]]
frame = "there"
pool = "test"
setting = "spatial"
needs.tasks = ["SwingXtimes"]
introduction = "Sand it {place:spot}."
say.color = ["the cube <there place: there>"]
"""


def test_one_file_of_words_gives_each_of_its_tasks_its_own_commands():
    """SwingXtimes has its own command in the pool test, its own phrase for
    a number, and one scenario more; all else is shared with PickXtimes."""
    pick = read_scenario_file(FILE_FOR_TWO_TASKS)
    swing = read_scenario_file(FILE_FOR_TWO_TASKS, "SwingXtimes")

    assert pick.commands["train"] == swing.commands["train"] == ("Move {color} {repeats}.",)
    assert pick.commands["test"] == ("Take {color} {repeats}.",)
    assert swing.commands["test"] == ("Swing {color} {repeats}.",)
    assert pick.stated["color"] == swing.stated["color"]
    assert pick.stated["repeats"] != swing.stated["repeats"]
    assert [scenario.fields.frame for scenario in pick.scenarios] == ["here"]
    assert [scenario.fields.frame for scenario in swing.scenarios] == ["here", "there"]


def test_a_file_without_commands_uses_our_commands_of_each_task():
    text = FILE_FOR_TWO_TASKS.partition("[commands.all]")[0] + BIRTHDAY.partition("\n")[2]
    for task in ("PickXtimes", "SwingXtimes"):
        own = task_scenarios(task)
        assert read_scenario_file(text, task).commands == own.commands
        (scenario,) = read_scenario_file(text, task).scenarios
        assert scenario not in own.scenarios


MOST_SHARED_WORDS = 0.7
"""Share of words from which two introductions are the same one with other nouns."""


def scenarios_of(pool):
    """Return the scenarios of a pool, each once, though several tasks may say it."""
    by_name = {
        (get_task(task).words, scenario.fields.setting, scenario.fields.frame): scenario
        for task in WRITTEN
        for scenario in task_scenarios(task).scenarios
        if scenario.fields.pool == pool
    }
    return list(by_name.values())


def is_said(row, text):
    """Return whether a file has the words of a row, with any noun for ``*``, any words: ``**``."""
    words = row.words if "<" in row.words else f"<{row.words}>"
    pattern = re.escape(words.replace('"', "'")).replace(r"\*\*", "[A-Za-z{}' ]+")
    pattern = pattern.replace(r"\*", "[a-z]+")
    return re.search(pattern, text) is not None


def test_every_pointer_is_used_both_in_training_and_in_test_words():
    """A pointer refers back, such as *the latter*. One that training lacks would
    be new to whoever learned from it, and the test would measure vocabulary."""
    said = dict.fromkeys(POOLS, "")
    for file in {get_task(task).words for task in WRITTEN}:
        written = tomllib.loads((FOLDER / file).read_text())["scenario"]
        for scenario in written:
            text = str(scenario).replace('"', "'")
            said[scenario["pool"]] += re.sub(r"<[a-z]+ [^:<>]+: ", "<", text)

    lacking = [
        (row.words, pool)
        for row, pool in itertools.product(pointer_table(), POOLS)
        if not is_said(row, said[pool])
    ]

    assert not lacking


def test_no_instruction_of_the_test_split_occurs_in_training():
    """Explicit commands are left out: these are equal wherever the goals are."""
    said = dict.fromkeys(POOLS, frozenset())
    settings = [name for name in all_settings() if name != "explicit"]

    for task, split in itertools.product(WRITTEN, ("train", "val", "test")):
        pool = "test" if split == "test" else "train"
        episodes = split_episodes([task], [split])
        options = InstructionOptions()
        told = instructions(episodes, settings, ["implicit"], options)
        said[pool] |= {instruction.text for _, instruction in told}

    assert said["train"]
    assert not said["train"] & said["test"]


def test_every_scenario_name_is_unique_over_training_and_test_words():
    """Sentences are compared by the checker, which compares with all tasks."""
    frames = [scenario.fields.frame for pool in POOLS for scenario in scenarios_of(pool)]
    assert len(frames) == len(set(frames))


def test_no_test_introduction_is_a_training_one_with_other_nouns():
    """Two introductions count as alike if they share 70 % of their words in the same order."""

    def words_of(scenario):
        introduction = literal(scenario.text("introduction")).lower()
        return re.findall(r"[\w']+", re.sub(r"\{[^}]*\}", "_", introduction))

    known = [words_of(scenario) for scenario in scenarios_of("train")]
    for scenario in scenarios_of("test"):
        words = words_of(scenario)
        for other in known:
            alike = difflib.SequenceMatcher(None, words, other, autojunk=False).ratio()
            assert alike < MOST_SHARED_WORDS, (words, other)


def test_that_many_times_is_never_said_of_once():
    """But of a one that was spun, where another number was, too."""
    words = task_scenarios("PickXtimes")
    scenarios = []
    for scenario in words.scenarios:
        if scenario.fields.setting == "direct" and "that many times" in str(scenario.texts):
            scenarios.append(scenario)

    found = defaultdict(set)
    for episode, scenario in itertools.product(scenes_of("PickXtimes", 0), scenarios):
        pool = scenario.fields.pool
        request = request_of(episode, InstructionOptions("direct", wordings=pool))
        chosen = choose(request, "direct", [scenario])
        said = spoken_instruction(request, say_chosen(request, words, chosen)).command
        if "that many times" in said:
            found[pool].add(episode.goal["repeats"])

    assert found == {pool: {2, 3, 4, 5} for pool in POOLS}


ONE_STEP_BACK_FILE = """
tasks = ["VideoPlaceOrder"]
[[scenario]]
frame = "one step"
pool = "test"
setting = "reasoning"
derive.pattern = "number deduction"
derive.relations = ["one earlier"]
introduction = "From the cube's {reference} target, we go back {step}."
say.placement = ["<that reference: that one>"]
"""


@pytest.mark.parametrize(("relation", "way"), [("one earlier", "back"), ("one later", "on")])
def test_one_step_means_earlier_or_later_as_its_scenario_declares(relation, way):
    """*We go back one* and *we go on one* use the same mark, `{step}`."""
    text = ONE_STEP_BACK_FILE.replace("one earlier", relation).replace("back", way)
    scenes = scenes_of("VideoPlaceOrder", 0)[::4]

    (report,) = check_scenarios(read_scenario_file(text, "VideoPlaceOrder"), None, scenes)

    assert report.scenes > report.broken.total() == 0
    assert all(f"go {way} one. " in text for text in report.renderings)


def test_a_phrase_that_is_left_out_for_once_leaves_no_gap_in_the_command():
    """*Put it back once for each rep, then press*: for one repetition the phrase is empty."""
    words = task_scenarios("VideoRepick")
    found = {}
    for episode in scenes_of("VideoRepick", 0)[::9]:
        request = request_of(episode, InstructionOptions("direct", wordings="train"))
        (reps,) = (scenario for scenario in words.scenarios if scenario.fields.frame == "gym reps")
        said = spoken_instruction(
            request, say_chosen(request, words, choose(request, "direct", [reps]))
        )
        found[episode.goal["repeats"]] = said.command, len(said.mentions), said.meaning

    command, mentions, meaning = found[1]

    assert re.fullmatch("Pick up .* and put it back, then press the button.", command)
    assert (mentions, meaning.settled, meaning.agrees) == (1, frozenset(), {"repeats": True})
    assert "put it back once for each rep, then" in found[2][0]


def test_no_number_of_one_or_two_is_given_away_by_singular_or_plural():
    """*Once for that run* is one, and *once for each run* would be
    two: a command with one of them leaves the color at least."""
    scenarios = task_scenarios("PickByCount").scenarios
    for scenario in scenarios:
        said = str(scenario.texts.get("say.repeats", ()))
        assert "Agreement" not in said or scenario.said == ("color", "repeats"), scenario.fields


def test_each_of_the_three_remarks_of_a_scenario_comes_first_in_some_episode():
    """240 dialogues with one remark each: every scenario should show each of its remarks."""
    found = defaultdict(set)
    for index in range(240):
        episode = get_episode("StopCube", "random", index)
        said = instruct_with(episode, InstructionOptions("contextual"))
        (aside,) = (
            utterance.text for utterance in said.utterances if utterance.stage == "distractor"
        )
        found[said.metadata["scenario"]].add(re.sub(r"^(?:He|She)", "", aside))
    assert all(len(asides) == 3 for asides in found.values()), found


def test_an_introduction_may_list_colors_and_then_pick_one_by_its_position():
    """*It's the second one's turn, so lift the
    container over it.*"""
    words = task_scenarios("VideoUnmask")
    scenes = scenes_of("VideoUnmask", 0)[::10]

    (report,) = check_scenarios(words, "video series", scenes)

    assert report.scenes > report.broken.total() == 0


@pytest.mark.parametrize("task", ["ButtonUnmask", "ButtonUnmaskSwap"])
def test_introductions_do_not_mention_containers_that_are_not_there_yet(task):
    """In these tasks the containers come down only after the button is pressed."""
    for scenario in task_scenarios(task).scenarios:
        texts = {name: text for name, text in scenario.texts.items() if "say." not in name}
        for text in itertools.chain.from_iterable(texts.values()):
            assert not re.search("container|hidden|watched|where .* went", literal(text))
        for text in scenario.texts["say.colors.0"]:
            assert literal(text).startswith("the container over ")


def test_a_place_before_containers_move_is_said_to_be_one_at_the_start():
    for scenario in task_scenarios("VideoUnmaskSwap").scenarios:
        said = f"{literal(scenario.text('introduction'))} {literal(scenario.text('say.colors.0'))}"
        if scenario.fields.setting == "spatial" or "aside" in str(scenario.texts):
            assert re.search(
                "start|beginning|early in the video|before .* moved|as soon as they moved", said
            )


def test_the_latter_may_follow_one_cube_named_by_place_and_one_by_color():
    text = """
tasks = ["ButtonUnmask"]
[[scenario]]
frame = "one each"
pool = "test"
setting = "spatial"
introduction = "I get the cube {place.0:any}, and {person.2} gets the {colors.1} cube."
say.colors.0 = ["the container over <other place.0: mine>"]
say.colors.1 = ["the one over <latter colors.1: {person.2}'s>"]
"""
    scenes = scenes_of("ButtonUnmask", 40)

    (report,) = check_scenarios(read_scenario_file(text, "ButtonUnmask"), None, scenes)

    assert report.scenes > report.broken.total() == 0


def test_his_or_hers_may_stand_for_the_color_that_a_person_wants():
    text = TWO_CUBES.replace("We have", "{person} wants").replace(
        "they still sell", "{person.2} wants"
    )
    text = text.replace("<former list.0: the former>", "<former list.0: {hers}>")
    words = read_scenario_file(text)

    (report,) = check_scenarios(words, None, scenes_of("PickXtimes", 0)[::4])

    assert not report.broken
    assert any(re.search(r" (?:his|hers): ", text) for text in report.renderings)


def test_words_of_a_task_without_moving_containers_do_not_speak_of_following_one():
    moved = r"follow|keep(?:ing)? (?:up|track)|los(?:es?|t|ing) track|shell game"
    for scenario in task_scenarios("ButtonUnmask").scenarios:
        texts = itertools.chain.from_iterable(scenario.texts.values())
        assert not re.search(moved, " ".join(map(literal, texts))), scenario.fields.frame


ELSEWHERE = r"last|year|yesterday|home|at work|used to|his|her\b|their|old"
"""Words of a cube that is not on the table."""


@pytest.mark.parametrize("task", ["PickXtimes", "SwingXtimes", "VideoUnmask", "ButtonUnmaskSwap"])
def test_a_remark_about_another_cube_places_it_away_from_the_table(task):
    """After *It's nicer than my green one*, *that cube* is the green one on the table."""
    for scenario in task_scenarios(task).scenarios:
        told = [literal(text) for text in scenario.texts.get("competing", ())]
        rivals = [text for text in told if "{rival color" in text]
        assert all(re.search(ELSEWHERE, text, re.IGNORECASE) for text in rivals), rivals
        assert not rivals or "that cube" not in literal(scenario.text("cue"))


def test_the_one_i_mentioned_always_says_where_it_was_mentioned():
    """A competing remark mentions another one, but not there."""
    for scenario in itertools.chain.from_iterable(map(scenarios_of, POOLS)):
        for texts in (scenario.texts.get(f"say.{name}", ()) for name in ("color", "colors.0")):
            said = " ".join(map(literal, texts))
            assert "I mentioned" not in said or re.search("I mentioned (?:to|in) ", said), said


BEFORE_OR_AFTER_FILE = """
tasks = ["VideoPlaceButton"]
[[scenario]]
frame = "gone"
pool = "test"
setting = "reasoning"
derive.pattern = "contextual logic"
list = "relation"
introduction = "The target the robot used right {taken} pressing the button is gone."
say.relation = ["on <other taken: the other one it used>"]
"""
"""One of two moments is named, and the other one is meant."""


def test_the_other_one_may_mean_the_moment_that_was_not_named():
    """There are two moments, before and after a press; one is named as gone."""
    words = read_scenario_file(BEFORE_OR_AFTER_FILE, "VideoPlaceButton")
    (report,) = check_scenarios(words, None, scenes_of("VideoPlaceButton", 0)[::10])
    assert report.scenes > report.broken.total() == 0


def test_the_other_one_is_refused_if_two_of_three_colors_could_be_meant():
    text = BEFORE_OR_AFTER_FILE.replace('"relation"', '"color"').replace(".relation", ".color")
    text = text.replace("target the robot used right {taken} pressing the button", "{taken} cube")
    text = text.replace("on <other taken: the other one it used>", "<other taken: the other one>")
    words = read_scenario_file(text, "VideoPlaceButton")
    (report,) = check_scenarios(words, None, scenes_of("VideoPlaceButton", 0)[::10])

    assert "means no goal, another one, or several" in report.broken

    either = "say.color must stand for the goal's value; it stands for blue or red"
    assert either in report.broken


def test_one_may_refer_to_a_cube_and_another_to_a_moment_in_the_same_scenario():
    words = task_scenarios("VideoPlaceButton")
    scenes = scenes_of("VideoPlaceButton", 0)[::10]

    (report,) = check_scenarios(words, "belongs there", scenes)

    assert report.scenes > report.broken.total() == 0


def test_a_target_that_has_moved_may_still_be_called_there():
    words = task_scenarios("VideoPlaceButton")
    scenes = scenes_of("VideoPlaceButton", 0)
    moved = [scene for scene in scenes if scene.scene.motions_of(Swap)][::5]

    (report,) = check_scenarios(words, "target to test", moved)

    assert report.scenes > report.broken.total() == 0


def test_the_target_on_the_left_is_not_taken_for_words_that_refer_back():
    scenes = scenes_of("VideoPlaceButton")
    (report,) = check_scenarios(
        task_scenarios("VideoPlaceButton"), "going with that target", scenes
    )

    assert any("target on the left" in text for text in report.resolved)
    assert not report.broken
