"""Scenarios (templates of texts in data files), and the checker for those who write them.

A scenario is a little story around a command. In it, ``{color}`` stands for the color of the goal;
``<it color: it>`` is a *pointer*, a word that refers back, here to the color.
"""

import difflib
import itertools
import json
import re
from collections import defaultdict
from dataclasses import replace
from pathlib import Path

import pytest
from language_variants import expressible_options, first_episodes, said_where_possible
from wording_stand_ins import BIRTHDAY, WOBBLY, report_on, take_words

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
from roboirg.core.word_pools import POOLS
from roboirg.language import LANGUAGE_VERSION, instruct, instruct_with
from roboirg.language.generator import find_refusal, request_of, spoken_instruction
from roboirg.language.instruction import Instruction, Mention, Utterance
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
from roboirg.language.variants import instructions
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.tasks import get_task
from roboirg.tasks.splits.splits import get_episode, split_episodes

WRITTEN = [*written_words()]
each_task = pytest.mark.parametrize("task", WRITTEN)
each_pool = pytest.mark.parametrize("pool", POOLS)
DOCS = Path(__file__).parents[2] / "docs"
*EXAMPLES_OF_THE_PAGE, _ = re.findall(
    r"```toml\n(.*?)```", (DOCS / "add-scenario.md").read_text(), re.DOTALL
)
"""The smallest file, what to add to it, two spatial scenarios; without the whole sentence."""
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
"""*We have the red cube, and they still sell the blue one. Do the former: lift it …*"""
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
"""*Mia needs five photos, and I took two. Lift the blue cube … once for each photo.*"""


def read_scenario_file(text, task="PickXtimes"):
    """Return what a file says of a task."""
    return read_task_scenarios(text, "mine.toml")[task]


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
            "<each repeats:",
            "<it repeats:",
            "|once for each year]>; in pointers.toml these words have the class 'each' for a nu",
        ),
        ("<it color: it>.", "<it color it>.", "has a bracket that is no mark"),
        ("{rival color}", "{rival visit}", "known: aside.0"),
        ("\ncue = ", "\nclue = ", "'birthday': There is no field 'clue'; known: competing, cue,"),
        (
            '\ncue = "Let\'s surprise {him} with the cube."',
            "",
            "'birthday' has no cue; direct needs introduction, reinf",
        ),
        ('pool = "train"', 'pool = "dev"', "'birthday', pool is 'dev'; it must be train or test."),
        ('pool = "train"\n', "", "'birthday' has no pool."),
        ("[[scenario]]", "[[scenario", "(at line 3, column 11)"),
        (
            "[[scenario]]",
            '[commands.StopCube]\ntrain = ["Go."]\n[[scenario]]',
            "'StopCube'; known: PickXtimes, all.",
        ),
        (
            'pool = "train"\n',
            'pool = "train"\nneeds.tasks = ["StopCube"]\n',
            "'birthday', needs.tasks: There is no task 'StopCube'; known: PickXtimes.",
        ),
    ],
    ids=[
        "misspelled slot",
        "unknown pointer",
        "class of another color pointer",
        "class of another number pointer",
        "no colon",
        "no such rival",
        "misspelled field",
        "missing field",
        "unknown pool",
        "no pool",
        "no TOML",
        "commands of another task",
        "needs another task",
    ],
)
def test_a_mistake_in_a_scenario_file_is_reported_with_file_scenario_and_field(
    before, after, complaint
):
    """Each case replaces `before` by `after` in a file without a mistake, the story of a birthday.

    Its text is in wording_stand_ins.py; the table pointers.toml lists the words that refer back.
    """
    assert before in BIRTHDAY

    with pytest.raises(InvalidValueError, match=r"^mine\.toml") as found:
        read_scenario_file(BIRTHDAY.replace(before, after))

    assert complaint in str(found.value)


def test_an_unknown_pointer_is_refused_with_the_five_nearest_known_ones():
    """A pointer is words that refer back to a value that was introduced, as `{reference}` is here:
    *as many as Mia has*. Only the words of a table are allowed. It has *two fewer than that*, but
    not *two times fewer than he did*; so the error names, after a colon, the five that are most
    alike, *two fewer than that* among them."""
    text = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "birthday"
pool = "train"
setting = "direct"
introduction = "{person} turns {repeats} today and wants to see the {color} cube."
reinforcement = "{he} keeps talking about <it color: it>."
distractors = ["The cake is at the baker's.", "I forgot the candles.", "It's so loud in here."]
competing = ["{person.2} has a {rival color} one."]
cue = "Let's surprise {him} with the cube."
say.color = ["{step} fewer [step: time|times] than <that reference: {he} did>"]
"""

    with pytest.raises(InvalidValueError) as found:
        read_scenario_file(text)

    _, _, rest = str(found.value).partition("which does not exist; the nearest for a reference: ")
    listed, _, _ = rest.partition(" (* is any noun)")
    nearest = listed.split("; ")
    assert len(set(nearest)) == len(nearest) == 5
    assert "{step:*} fewer than <that reference: that>" in nearest


def test_all_mistakes_of_a_scenario_file_are_reported_at_once():
    """The first scenario has five mistakes: the pool dev, the field clue, the slots repeat and
    colr, and the pointer <them color: it>. The second one has the field remarks.latest, so it lacks
    remarks.not_latter. Each is reported in a line of the error, which goes on with a cure."""
    text = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "birthday"
pool = "dev"
setting = "direct"
introduction = "{person} turns {repeat} today and wants to see the {colr} cube."
reinforcement = "{he} keeps talking about <them color: it>."
distractors = ["I forgot the candles.", "It's so loud in here.", "I'm hungry."]
competing = ["{person.2} has a {rival color} one."]
clue = "Let's surprise {him} with the cube."
say.color = ["<it color: it>"]
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
remarks.latest = "Not <latter list.1: the latter>: "
"""

    with pytest.raises(InvalidValueError) as found:
        read_scenario_file(text)

    complaints = [
        "'birthday', pool is 'dev'",
        "'birthday': There is no field 'clue'",
        "'birthday', introduction: There is no slot 'repeat'",
        "'birthday', introduction: There is no slot 'colr'",
        "'birthday', reinforcement has the pointer <them color: it>",
        "'two': There is no field 'remarks.latest'",
        "'two' has no remarks.not_latter",
    ]
    lines = str(found.value).splitlines()
    for line, complaint in zip(lines, complaints, strict=True):
        assert line.startswith(f"mine.toml, scenario {complaint}")


@pytest.mark.parametrize("text", [BIRTHDAY, TWO_CUBES, FEWER], ids=["birthday", "two", "fewer"])
def test_the_checker_finds_nothing_wrong_with_a_good_scenario(text):
    """The other tests put a mistake into one of these."""
    assert not report_on(text, every=10).broken


@pytest.mark.parametrize(
    ("before", "after", "rule"),
    [
        ("turns {repeats} today and ", "", "points at what the"),
        ("wants to", "has a {color} one and wants to", "has 2 antecedents"),
        ("Let's surprise", "You saw this. Surprise", "what was seen is not checked"),
        ("The cake", "The second cake", "names second, which could be a value"),
        ("The cake", "On the left, the cake", "names on the left"),
        ("The cake", "Four, the cake", "names four"),
        ("The cake", "Look at that cake", "may be covered"),
        ('say.color = ["', 'lead = "Twice: "\nsay.color = ["', "gives away twice"),
        ("The cake", "The cake " + "is so very good " * 9, "only 64 are heard"),
        (
            "{rival color} one",
            "{rival color} one {list}",
            "a competing remark with a value for list or rival color in this",
        ),
    ],
    ids=[
        "not introduced",
        "named twice",
        "seen",
        "a value",
        "a place",
        "a number",
        "another pointer",
        "leak",
        "too long",
        "no list",
    ],
)
def test_the_checker_for_authors_names_the_rule_that_a_scenario_breaks(before, after, rule):
    """Each case replaces `before` by `after` in BIRTHDAY, a scenario that breaks no rule: *Leo
    turns two today and wants to see the red cube. … The cake is at the baker's. … Lift it … once
    for each year.* The checker must report the rule."""
    assert before in BIRTHDAY

    broken = report_on(BIRTHDAY.replace(before, after), every=10).broken

    assert rule in "\n".join(broken)


@pytest.mark.parametrize(
    ("text", "before", "after", "rule"),
    [
        (TWO_CUBES, "Do <former list.0: the former>", "Do <latter list.1: the latter>",
         "first point"),
        (FEWER, "[repeats: for the photo|once for each photo]", "once for each of them",
         "say.repeats must stand"),
        (FEWER, " {reference:photo}", "", "says the same of another goal"),
    ],
    ids=["former", "each of them", "no number"],
)  # fmt: skip
def test_the_checker_finds_pointers_that_stand_for_another_value_or_for_none(
    text, before, after, rule
):
    """TWO_CUBES: *Do the latter* where its remark `former` must point at the first of two cubes.

    FEWER: *once for each of them* stands for something that was listed, and nothing was; without
    the number of photos, *I took two* fits every goal.
    """
    assert before in text

    broken = report_on(text.replace(before, after), every=10).broken

    assert rule in "\n".join(broken)


def only_command(text, mentions=(), landmarks=()):
    """Return an instruction that is one command."""
    return Instruction(
        "VideoUnmask", "VideoUnmask/test/3", "direct", "implicit",
        (Utterance("command", text),), tuple(mentions), {"landmarks": [*landmarks]},
    )  # fmt: skip


def test_a_color_of_the_goal_in_the_command_is_found_as_a_leak():
    """A command that refers back must not name what the introduction has said. The goal is the
    green cube, then the red one: *red* is a value of it."""
    said = only_command("Lift the first cube, then the other red cube.")
    assert find_leaks(said, Goal.of(colors=("green", "red"))) == {"red"}


FIRST_REFERS_BACK = Mention(0, 12, 17, "anaphor", "first", "visit", 1)
"""Marks the characters 12 to 17 as a word that refers back."""


@pytest.mark.parametrize(("mentions", "leaks"), [([], {"first"}), ([FIRST_REFERS_BACK], set())])
def test_words_that_refer_back_are_no_leak(mentions, leaks):
    """A leak is a value of the goal in the command. *First* names the visit of the goal, unless a
    mention marks its characters as a word that refers back, to the first of two in a list."""
    said = only_command("Stop it the first time.", mentions)
    assert find_leaks(said, Goal.of(visit=1)) == leaks


def test_a_place_of_the_goal_in_the_command_is_found_as_a_leak():
    """The metadata has two places of the objects of the goal. The command names one, *at the far
    left*; *closest to you* is not said."""
    landmarks = ["at the far left", "closest to you"]
    said = only_command("Lift the cube at the far left.", landmarks=landmarks)
    assert find_leaks(said, Goal.of(visit=1)) == {"at the far left"}


@pytest.mark.parametrize(
    ("command", "leaks"),
    [
        ("Lift the one before that one.", set()),
        ("Move it over both targets.", set()),
        ("Lift it one time.", {"one"}),
    ],
)
def test_the_word_one_is_a_leak_only_where_it_is_a_number(command, leaks):
    """The goal is to lift the red cube once."""
    assert find_leaks(only_command(command), Goal.of(color="red", repeats=1)) == leaks


def our_scenarios(task, setting, pool):
    """Return our scenarios of a task in a setting and a pool."""
    found = []
    for scenario in task_scenarios(task).scenarios:
        if (scenario.fields.setting, scenario.fields.pool) == (setting, pool):
            found.append(scenario)
    return found


@pytest.mark.parametrize(
    ("text", "setting"), [(BIRTHDAY, "direct"), (FEWER, "reasoning")], ids=["direct", "reasoning"]
)
def test_adding_a_scenario_changes_only_the_episodes_that_choose_it(text, setting):
    """Each episode draws one of the scenarios that fit it. The file has one scenario more for this
    setting; an episode that does not draw the new one must keep what it drew before. `choices` has
    what the 200 published episodes draw with it: some, but not all, must draw the new one, or
    nothing would be compared."""
    (added,) = read_scenario_file(text).scenarios
    known = our_scenarios("PickXtimes", setting, "train")
    choices = []

    for episode in scenes_of("PickXtimes", 0):
        request = request_of(episode, InstructionOptions(setting, wordings="train"))
        choice = choose(request, setting, [*known, added])
        choices.append(choice.scenario)
        if choice.scenario is not added:
            assert choice == choose(request, setting, known), episode.key

    assert 0 < choices.count(added) < len(choices) / 2


def test_the_example_file_of_the_documentation_has_a_scenario_for_every_scene():
    """docs/add-scenario.md shows a user's file with "fresh paint" and "photos", and then two
    spatial scenarios, "wobbly table" and "wasp". Together, in every fourth published scene of
    PickXtimes, they break no rule of the checker, and no setting that they have words for is left
    without one that fits (`unserved_settings`)."""
    scenes = scenes_of("PickXtimes", 0)[::4]
    words = parse_wordings("".join(EXAMPLES_OF_THE_PAGE), "mine.toml").tasks["PickXtimes"]

    reports = check_scenarios(words, None, scenes)

    broken = {report.scenario.fields.frame: dict(report.broken) for report in reports}
    assert broken == {"fresh paint": {}, "photos": {}, "wobbly table": {}, "wasp": {}}
    assert list(unserved_settings(reports, scenes, Path("mine.toml"))) == []


@pytest.mark.parametrize(
    ("text", "before", "after", "reason"),
    [
        (FEWER, "two fewer", "nine fewer", "the goal follows in no way that setting, say, list"),
        (WOBBLY, "{place:spot}", "{clue}", "nothing has the place or clue that the introduction"),
        (WOBBLY, "{place:spot}", "{place.1}", "nothing has the place or clue that the introd"),
    ],
    ids=["no number is nine fewer", "no cube has a clue", "no cube has a second place"],
)
def test_a_scenario_that_fits_no_scene_is_reported_with_the_reason(text, before, after, reason):
    """FEWER and WOBBLY are good scenarios, *Mia needs five photos, and I took two …* and *The table
    wobbles on the left …*; `before` is replaced by `after` in one. No number of a goal is nine
    fewer than another, no cube has a clue in the setting *spatial*, and none a second place. So no
    scene fits, and the reason is that of the first one, PickXtimes/train/0."""
    *_, last_rule = report_on(text.replace(before, after)).broken
    assert last_rule.startswith(f"fits none of the scenes; in PickXtimes/train/0 {reason}")


def test_the_report_for_authors_shows_a_competing_remark_of_a_contextual_dialogue():
    """Such a remark is about a color that is not wanted: *My aunt has a green one.*"""
    lines = list(report_lines(report_on(BIRTHDAY), "PickXtimes"))
    (shown,) = [line for line in lines if line.startswith("  With a competing remark: ")]
    assert re.search(r" has a \w+ one\. Let's surprise", shown)


def test_the_report_for_authors_shows_no_competing_remark_if_the_setting_has_none():
    """The scenario, *We have the red cube, and they still sell the blue one*, is of the setting
    *direct-rival*, which has no remarks about a color that is not wanted."""
    lines = report_lines(report_on(TWO_CUBES), "PickXtimes")
    assert not any("competing" in line for line in lines)


@pytest.mark.parametrize(
    ("words", "is_broken"),
    [
        ("the container over <other colors.0: the other one>", False),
        ("the one over <other colors.0: mine>", False),
        ("<other colors.0: the other one>", True),
    ],
)
def test_a_command_to_lift_the_cube_instead_of_its_container_is_a_broken_rule(words, is_broken):
    """In VideoUnmask cubes are under containers. *Lift the other one* would mean the cube, which
    nobody can lift through its container; *the container over the other one* and *the one over
    mine* mean the container."""
    text = f"""
tasks = ["VideoUnmask"]
[[scenario]]
frame = "two for us"
pool = "train"
setting = "reasoning"
derive.pattern = "contextual logic"
list = "colors"
needs.colors = [1]
introduction = "The {{list}} cubes are for us, and {{person}} has picked the {{taken}} one."
say."colors.0" = ["{words}"]
"""
    (scenario,) = read_scenario_file(text, "VideoUnmask").scenarios
    rules = "; ".join(broken_sentences(scenario, "container"))
    assert ("a container is lifted" in rules) == is_broken


def test_a_text_that_is_too_long_only_when_it_names_everything_is_reported():
    """Policies hear 64 tokens. With its long competing remark this story just fits while it says
    *it*; in the form *resolved* its command names every value again, *Pick up the red cube …*,
    which is longer. The report has the rule that is broken, and below it the text that is too
    long."""
    text = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "birthday"
pool = "train"
setting = "direct"
introduction = "{person} turns {repeats} today and wants to see the {color} cube."
reinforcement = "{he} keeps talking about <it color: it>."
distractors = ["The cake is at the baker's.", "I forgot the candles.", "It's so loud in here."]
competing = ["<it color: it> is much prettier than {person.2}'s {rival color} one."]
cue = "Let's surprise {him} with the cube."
say.color = ["<it color: it>"]
say.repeats = ["<each repeats: [repeats: once for that year|once for each year]>"]
"""

    report = "\n".join(report_lines(report_on(text, every=8), "PickXtimes"))

    assert re.search(r"  BROKEN needs \d+ tokens; only 64 are heard", report)
    assert re.search(r"\n    resolved: .*Pick up the \w+ cube and put it on the target", report)


def test_right_now_at_once_and_a_second_are_not_taken_for_values():
    """The checker refuses words that could be a value of the goal, such as *right*, *left*, *once*
    or *second*. In this story they are none: *right now*, *it's left*, *at once*, *a second*."""
    text = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "birthday"
pool = "train"
setting = "direct"
introduction = "My cat turns {repeats} today and wants to see the {color} cube."
reinforcement = "All right, right now it's left."
distractors = ["Once we're done, at once.", "Just a second.", "It's so loud in here."]
competing = ["{person} has a {rival color} one."]
cue = "Let's surprise it with the cube."
say.color = ["<it color: it>"]
say.repeats = ["<each repeats: [repeats: once for that year|once for each year]>"]
"""
    assert not report_on(text).broken


@each_task
@pytest.mark.parametrize("step", [25, pytest.param(1, marks=pytest.mark.slow)])
def test_none_of_our_scenarios_breaks_a_rule(task, step):
    """The checker's rules are applied to all our scenarios of a task: in every scene (slow), or in
    every 25th. In such a sample a scenario may find none that it fits."""
    for report in check_scenarios(task_scenarios(task), None, scenes_of(task)[::step]):
        for rule in report.broken:
            is_of_the_sample = step > 1 and rule.startswith("fits none of the scenes;")
            assert is_of_the_sample, (report.scenario.fields.frame, rule)


@each_task
def test_every_published_scene_can_be_commanded_in_every_setting_and_pool(task):
    """For each of our published scenes, setting and pool of words (training, tests) an instruction
    must be possible (None). Only two settings may refuse a scene: *grounded* if there is nothing to
    see that decides, and *direct-rival* if the goal counts cubes of several colors."""
    may_refuse = {
        "grounded": "nothing to see in this scene singles out a slot's value",
        "direct-rival": "a goal that counts cubes of several colors leaves no rival",
    }
    names = settings_of(get_task(task))
    for episode, name, pool in itertools.product(scenes_of(task, 0), names, POOLS):
        refusal = find_refusal(episode, InstructionOptions(name, wordings=pool))
        assert refusal in (None, may_refuse.get(name)), (episode.key, name, pool)


def test_a_story_does_not_speak_of_several_cubes_if_one_goes_into_the_bin():
    """*I need more cubes like the one on the left. So put one like that one into the bin* would be
    wrong: one cube is needed. Compared are all spatial texts of BinFill with *one like that* or
    *one of that color* in the command; *I … cubes* and *My mom wants cubes* are the ways in which
    our stories speak of several."""
    stories_of_one_cube = []
    options = InstructionOptions("spatial", wordings="train")
    for _, said in said_where_possible(split_episodes(["BinFill"], SPLITS), options):
        story, _, command = said.text.partition(". ")
        if re.search(r"\bone (like|of) that", command):
            stories_of_one_cube.append(story)

    assert stories_of_one_cube
    for story in stories_of_one_cube:
        assert not re.search(r"I\b.* cubes|My mom wants cubes", story), story


@pytest.fixture(scope="module", params=WRITTEN)
def some_instructions(request):
    """Eight episodes of both pools with all combinations of options that can express them.

    A list of (episode, options, instruction) of one task.
    """
    found = []
    for split, index in itertools.product(("train", "test"), range(8)):
        episode = get_episode(request.param, split, index)
        for options in expressible_options(episode):
            found.append((episode, options, instruct_with(episode, options)))
    return found


def test_no_instruction_has_marks_or_doubled_spaces_left(some_instructions):
    """`some_instructions` has what is said of eight episodes of a task with all options that can
    express them. Scenarios are written with marks, `{color}` and `<it color: it>`, which must all
    be replaced; a value that is left out must leave no two spaces or full stops, and no space
    before a comma."""
    for _, _, said in some_instructions:
        assert not re.search(r"[{}<>|\[\]]|  | [.,]|[.]{2}", said.text), said.text


def test_every_mention_marks_words_without_spaces_around_them(some_instructions):
    """`some_instructions` has what is said of eight episodes of a task with all options that can
    express them. A mention is the span of a text that stands for a value of the goal, such as *the
    blue cube*; it is not empty."""
    for _, _, said in some_instructions:
        for mention in said.mentions:
            span = said.span(mention)
            assert span.strip() == span != "", said.text


def test_metadata_of_instructions_are_plain_json_with_the_same_keys(some_instructions):
    """`some_instructions` has what is said of eight episodes of a task with all options that can
    express them. All have the same metadata as the explicit instruction; only those of a scenario
    name it, too."""
    for episode, _, said in some_instructions:
        assert json.loads(json.dumps(said.metadata)) == dict(said.metadata)
        assert said.metadata.keys() - {"scenario"} == instruct(episode).metadata.keys()
        assert said.metadata["language_version"] == LANGUAGE_VERSION


def test_only_spatial_instructions_have_a_frame_of_reference(some_instructions):
    """`some_instructions` has what is said of eight episodes of a task with all options that can
    express them. The frame says whose left and right is meant, the robot's or the camera's; only
    the setting *spatial* says left and right."""
    for _, options, said in some_instructions:
        assert (said.metadata["frame"] is not None) == (options.setting == "spatial"), said.text


def test_an_instruction_is_the_same_when_it_is_asked_for_again(some_instructions):
    """`some_instructions` has what is said of eight episodes of a task with all options that can
    express them. Asked for again, after all the others, each must be the same: words must not
    depend on what was said before."""
    for episode, options, said in some_instructions:
        assert instruct_with(episode, options) == said


def test_a_contextual_dialogue_without_context_is_a_direct_instruction(some_instructions):
    """`some_instructions` has what is said of eight episodes of a task with all options that can
    express them. A dialogue of the setting *contextual* has five stages, of which 1 is the
    introduction and 5 the command. With these two alone it is what *direct* says."""
    for episode, options, said in some_instructions:
        if options.setting == "contextual" and options.stages == (1, 5):
            direct = instruct_with(episode, replace(options, setting="direct"))
            assert said.turns == direct.turns


def test_a_resolved_command_ends_with_the_explicit_command(some_instructions):
    """`some_instructions` has what is said of eight episodes of a task with all options that can
    express them. The form *resolved* of the setting *direct* names every value, as in *So grab the
    blue cube and …*: after its first words it is the explicit command."""
    for episode, options, said in some_instructions:
        if (options.setting, options.form) == ("direct", "resolved"):
            explicit = instruct(episode, wordings=options.wordings)
            assert said.command.lower().endswith(explicit.command.lower())


@pytest.mark.parametrize(
    ("setting", "turns"),
    [
        (
            "spatial",
            (
                "I need to see the blue cube, but let's check in the middle first.",
                "Lift the container there and put it down, then lift the one over that cube.",
            ),
        ),
        (
            "grounded",
            (
                (
                    "I want to look under the container third from the right and then see the blue "
                    "cube."
                ),
                "Lift that container and put it down, then lift the one over that cube.",
            ),
        ),
        (
            "reasoning",
            (
                "The kids want to see the blue and red cubes, the red one first.",
                (
                    "Lift the container over it and put it down, then lift the one over the other "
                    "cube."
                ),
            ),
        ),
    ],
)
def test_of_two_containers_only_one_has_to_be_found_out(setting, turns):
    """The goal is the red cube, and then the blue one, each under a container. The introduction
    names one color and describes the other, or names both with their order; the command names
    neither. The texts were read once: in each setting one of the two has to be found out."""
    episode = get_episode("VideoUnmask", "random", 3)

    assert instruct(episode, setting, wordings="train").turns == turns


@pytest.mark.parametrize(
    ("setting", "command"),
    [
        (
            "spatial",
            "So put three like that one and two blue cubes into the bin, then press the button.",
        ),
        (
            "grounded",
            "So put two of that color and three green cubes into the bin, then press the button.",
        ),
    ],
)
def test_of_several_amounts_only_the_color_of_one_has_to_be_found_out(setting, command):
    """The goal is two blue cubes and three green ones. The color of either one may be hidden, so
    that its place among the goal's colors tells nothing."""
    episode = get_episode("BinFill", "random", 3)

    said = instruct(episode, setting, wordings="train")

    assert said.command == command
    assert said.metadata["hidden_slots"] == 1


def test_three_amounts_are_said_in_one_phrase_with_a_mention_for_each_value():
    """The goal is two red cubes, one blue and two green ones. A mention marks the words of the text
    that stand for one value of the goal; they come in the order of the text."""
    said = instruct(get_episode("BinFill", "test", 11))

    assert "two red cubes, one blue one and two green ones " in said.text
    values = [mention.value for mention in said.mentions]
    assert values == [2, "red", 1, "blue", 2, "green"]


def grounded_instructions(pattern):
    """Return the instructions of those of 60 random episodes in which the setting *grounded*
    describes the cube by a pattern, such as *place*; each with its resolved form."""
    options = InstructionOptions("grounded")
    found = []
    for episode, said in said_where_possible(first_episodes("PickXtimes", "random", 60), options):
        if said.metadata["pattern"] == pattern:
            found.append((said, instruct_with(episode, replace(options, form="resolved"))))
    assert found
    return found


@pytest.mark.parametrize(
    ("pattern", "sentences", "says_neither"),
    [("sets", 2, True), ("place", 1, False), ("betweenness", 1, False)],
)
def test_a_clue_that_excludes_two_objects_mentions_these_in_a_sentence_first(
    pattern, sentences, says_neither
):
    """The pattern *sets* excludes two cubes, in a sentence of its own: *There's a cube on the left
    and one next to the button. The other one is new.* Others need one sentence: *The cube in the
    middle is new.* Sentences of the first turn are counted by their full stops. Resolved, the
    command of *sets* says *neither … nor*."""
    for said, resolved in grounded_instructions(pattern):
        assert said.turns[0].count(".") == sentences, said.text
        assert ("neither" in resolved.command) == says_neither, resolved.text


@pytest.mark.parametrize("kind", ["neutral", "competing"])
def test_a_context_of_nine_remarks_begins_with_those_of_a_context_of_two(kind):
    """A dialogue has four turns besides its remarks, two before and two after them. So with nine
    remarks it has 13 turns; the first four, of which two are remarks, and the last two are those of
    the dialogue with two remarks."""
    episode = get_episode("PickXtimes", "train", 2)

    few = instruct(episode, "contextual", distractor=kind, distractors=2).turns
    many = instruct(episode, "contextual", distractor=kind, distractors=9).turns

    assert len(many) == 13
    assert many[:4] == few[:4]
    assert many[-2:] == few[-2:]


def test_planning_a_run_of_a_task_without_a_file_of_words_is_refused(monkeypatch):
    """`take_words` removes our file of words of VideoRepick, as if none had been written: there
    would be nothing to tell a policy."""
    take_words(monkeypatch, "VideoRepick")
    message = r"VideoRepick names no file of words \(write one, see"
    with pytest.raises(InvalidValueError, match=message):
        make_plan(["random"], tasks="VideoRepick", episodes="1")


def test_a_scenario_for_a_task_without_words_of_ours_needs_commands_of_its_own(monkeypatch):
    """`take_words` removes our words of VideoRepick. The file has a scenario for this task, the
    story of a birthday, but no command that would follow it."""
    take_words(monkeypatch, "VideoRepick")
    lacking = "has no commands of VideoRepick in the pool train."
    with pytest.raises(InvalidValueError, match=lacking):
        read_scenario_file(BIRTHDAY.replace("PickXtimes", "VideoRepick"))


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


@pytest.mark.parametrize(
    ("task", "train", "test"),
    [
        ("PickXtimes", "Move {color} {repeats}.", "Take {color} {repeats}."),
        ("SwingXtimes", "Move {color} {repeats}.", "Swing {color} {repeats}."),
    ],
)
def test_one_file_of_words_gives_each_of_its_tasks_its_own_commands(task, train, test):
    """FILE_FOR_TWO_TASKS has commands for all its tasks, *Move …* in training and *Take …* in
    tests, and one more for SwingXtimes in tests, *Swing …*, which takes the place of the shared
    one."""
    words = read_scenario_file(FILE_FOR_TWO_TASKS, task)
    assert words.commands == {"train": (train,), "test": (test,)}


def test_one_file_of_words_gives_a_task_its_own_phrase_for_a_number():
    """FILE_FOR_TWO_TASKS has phrases for color and number for all its tasks, and one more for the
    number in SwingXtimes, *for three laps*."""
    pick = read_scenario_file(FILE_FOR_TWO_TASKS, "PickXtimes").stated
    swing = read_scenario_file(FILE_FOR_TWO_TASKS, "SwingXtimes").stated

    assert pick["color"] == swing["color"]
    assert pick["repeats"] != swing["repeats"]


@pytest.mark.parametrize(
    ("task", "frames"), [("PickXtimes", ["here"]), ("SwingXtimes", ["here", "there"])]
)
def test_a_scenario_that_needs_a_task_is_said_in_that_task_only(task, frames):
    """FILE_FOR_TWO_TASKS has the scenarios "here" and "there" for PickXtimes and SwingXtimes;
    "there" has the line `needs.tasks = ["SwingXtimes"]`."""
    words = read_scenario_file(FILE_FOR_TWO_TASKS, task)
    assert [scenario.fields.frame for scenario in words.scenarios] == frames


@pytest.mark.parametrize("task", ["PickXtimes", "SwingXtimes"])
def test_a_file_without_commands_uses_our_commands_of_each_task(task):
    """The user's file has one scenario for two tasks, the story of a birthday, and no table
    `[commands]`. So each task has our commands of it."""
    text = BIRTHDAY.replace('tasks = ["PickXtimes"]', 'tasks = ["PickXtimes", "SwingXtimes"]')

    words = read_scenario_file(text, task)

    assert words.commands == task_scenarios(task).commands
    assert [scenario.fields.frame for scenario in words.scenarios] == ["birthday"]


def scenarios_of(pool):
    """Return our scenarios of a pool, each once, though several tasks may say it."""
    by_name = {}
    for task in WRITTEN:
        for scenario in task_scenarios(task).scenarios:
            if scenario.fields.pool == pool:
                name = get_task(task).words, scenario.fields.setting, scenario.fields.frame
                by_name[name] = scenario
    return list(by_name.values())


def pointers_written_in(pool):
    """Return all pointers in our scenarios of a pool, as one text, without their class and slot:
    ``<the latter>`` for what scenarios write as ``<latter color: the latter>``."""
    scenarios = []
    for file in {get_task(task).words for task in WRITTEN}:
        _, *written = (FOLDER / file).read_text().split("[[scenario]]")
        scenarios += [text for text in written if f'pool = "{pool}"' in text]
    return re.sub(r"<[a-z]+ [^:<>]+: ", "<", "\n".join(scenarios))


def is_used(row, text):
    """Return whether a text has the words of a row of the table of pointers.

    In the table ``*`` is any noun, and ``**`` any words.
    """
    words = row.words if "<" in row.words else f"<{row.words}>"
    pattern = re.escape(words).replace(r"\*\*", "[A-Za-z{}' ]+")
    return re.search(pattern.replace(r"\*", "[a-z]+"), text) is not None


@each_pool
def test_every_pointer_is_used_both_in_training_and_in_test_words(pool):
    """Pointers are words that refer back, such as *the latter*; a table has all that are allowed.
    Each must be written in a scenario of both pools, training and tests: one that training lacks
    would be new to whoever learned from it, and a test would measure vocabulary."""
    written = pointers_written_in(pool)

    unused = [row.words for row in pointer_table() if not is_used(row, written)]

    assert unused == []


def test_no_instruction_of_the_test_split_occurs_in_training():
    """All texts of all splits, tasks and settings, in the form that refers back. Explicit commands
    are left out: these are equal wherever the goals are."""
    texts = {"train": set(), "val": set(), "test": set()}
    settings = [name for name in all_settings() if name != "explicit"]

    for task, split in itertools.product(WRITTEN, texts):
        episodes = split_episodes([task], [split])
        for _, said in instructions(episodes, settings, ["implicit"], InstructionOptions()):
            texts[split].add(said.text)

    assert texts["train"]
    assert texts["test"].isdisjoint(texts["train"] | texts["val"])


def test_every_scenario_name_is_unique_over_training_and_test_words():
    """Metadata name the scenario of an instruction, and must not leave open which it is. Sentences
    are compared by the checker."""
    frames = [scenario.fields.frame for pool in POOLS for scenario in scenarios_of(pool)]
    assert len(frames) == len(set(frames))


def introduction_words(scenario):
    """Return the words of an introduction in lower case, with ``_`` for each mark."""
    introduction = literal(scenario.text("introduction")).lower()
    return re.findall(r"[\w']+", re.sub(r"\{[^}]*\}", "_", introduction))


def test_no_test_introduction_is_a_training_one_with_other_nouns():
    """Each introduction of a test scenario is compared with each of a training scenario, as lists
    of words in which values are blanks. They count as alike if they share 70 % of their words in
    the same order: a policy that has learned one would know the other."""
    training = [introduction_words(scenario) for scenario in scenarios_of("train")]
    for scenario in scenarios_of("test"):
        words = introduction_words(scenario)
        for other in training:
            alike = difflib.SequenceMatcher(None, words, other, autojunk=False).ratio()
            assert alike < 0.7, (words, other)


def said_with(scenario, episode):
    """Return what one of our scenarios says in an episode."""
    setting = scenario.fields.setting
    request = request_of(episode, InstructionOptions(setting, wordings=scenario.fields.pool))
    chosen = choose(request, setting, [scenario])
    return spoken_instruction(request, say_chosen(request, task_scenarios(episode.task), chosen))


@each_pool
def test_that_many_times_is_never_said_of_once(pool):
    """Each of our scenarios of PickXtimes in the setting *direct* speaks in each scene, whose goal
    may be to pick the cube up once to five times. *That many times* must occur with all numbers but
    one."""
    numbers = set()
    for scenario in our_scenarios("PickXtimes", "direct", pool):
        if "that many times" in str(scenario.texts):
            for episode in scenes_of("PickXtimes", 0):
                if "that many times" in said_with(scenario, episode).command:
                    numbers.add(episode.goal["repeats"])

    assert numbers == {2, 3, 4, 5}


@pytest.mark.parametrize(("relation", "way"), [("one earlier", "back"), ("one later", "on")])
def test_one_step_means_earlier_or_later_as_its_scenario_declares(relation, way):
    """A video shows a cube on several targets, one after the other. The story names one of them
    ({reference}) and a step ({step}, said as *one*); `derive.relations` declares whether the step
    goes back or on. The checker reports a text that means another goal than the episode's; so no
    broken rule says that *the third target, we go back one* means the second."""
    text = f"""
tasks = ["VideoPlaceOrder"]
[[scenario]]
frame = "one step"
pool = "test"
setting = "reasoning"
derive.pattern = "number deduction"
derive.relations = ["{relation}"]
introduction = "From the cube's {{reference}} target, we go {way} {{step}}."
say.placement = ["<that reference: that one>"]
"""

    report = report_on(text, "VideoPlaceOrder", every=4)

    assert report.fitting
    assert not report.broken
    assert all(f"go {way} one. " in said for said in report.renderings)


def said_with_gym_reps(repeats):
    """Return what our VideoRepick scenario "gym reps" says where a cube is picked up so often."""
    scenarios = task_scenarios("VideoRepick").scenarios
    (gym_reps,) = [scenario for scenario in scenarios if scenario.fields.frame == "gym reps"]
    for episode in scenes_of("VideoRepick", 0):
        if episode.goal["repeats"] == repeats:
            return said_with(gym_reps, episode)
    raise LookupError(repeats)


def test_a_phrase_for_several_repetitions_stands_in_the_command():
    """Our scenario "gym reps" of VideoRepick says *once for each rep* where a cube is to be picked
    up more than once. `said_with_gym_reps` has what it says in the first scene with this number."""
    said = said_with_gym_reps(repeats=2)

    assert "put it back once for each rep, then" in said.command


def test_a_phrase_that_is_left_out_for_once_leaves_no_gap_in_the_command():
    """Our scenario "gym reps" of VideoRepick says *put it back once for each rep, then …*, but for
    a cube that is to be picked up once *put it back, then …*"""
    said = said_with_gym_reps(repeats=1)

    assert re.fullmatch("Pick up .* and put it back, then press the button.", said.command)


def test_a_phrase_that_is_left_out_for_once_still_agrees_with_the_number_one():
    """Our scenario "gym reps" of VideoRepick leaves *once for each rep* out of the command where it
    is once. So its text has one mention, *Let's do one rep*, and the declared meaning is that the
    words agree with the number of the goal."""
    said = said_with_gym_reps(repeats=1)

    assert len(said.mentions) == 1
    assert said.meaning.settled == frozenset()
    assert said.meaning.agrees == {"repeats": True}


def test_no_number_of_one_or_two_is_given_away_by_singular_or_plural():
    """In PickByCount a cube is picked up once or twice. *Once for that run* is one, and *once for
    each run* would be two: a scenario whose words agree with the number ("Agreement") has to leave
    the color to be found out, too, so both slots are said by it."""
    for scenario in task_scenarios("PickByCount").scenarios:
        if "Agreement" in str(scenario.texts.get("say.repeats", ())):
            assert scenario.said == ("color", "repeats"), scenario.fields.frame


def test_each_of_the_three_remarks_of_a_scenario_comes_first_in_some_episode():
    """A scenario has three distracting remarks. In 240 dialogues with one remark each, every
    scenario that is said must show each of them; *He* and *She* at the beginning are left out, as
    persons differ."""
    found = defaultdict(set)
    for index in range(240):
        episode = get_episode("StopCube", "random", index)
        said = instruct_with(episode, InstructionOptions("contextual"))
        (remark,) = [part.text for part in said.utterances if part.stage == "distractor"]
        found[said.metadata["scenario"]].add(re.sub(r"^(?:He|She)", "", remark))

    for frame, remarks in found.items():
        assert len(remarks) == 3, frame


@pytest.mark.parametrize("task", ["ButtonUnmask", "ButtonUnmaskSwap"])
def test_introductions_do_not_mention_containers_that_are_not_there_yet(task):
    """In these tasks the containers come down only after the button is pressed, and the words are
    heard before. Left out are the words of commands ("say."), such as *the container over the
    cube*, which is lifted later."""
    before_the_command = []
    for scenario in task_scenarios(task).scenarios:
        for name, texts in scenario.texts.items():
            if "say." not in name:
                before_the_command += [literal(text) for text in texts]

    assert before_the_command
    for words in before_the_command:
        assert not re.search("container|hidden|watched|where .* went", words), words


@pytest.mark.parametrize("task", ["ButtonUnmask", "ButtonUnmaskSwap"])
def test_commands_for_cubes_that_will_be_covered_say_the_container_over_the_cube(task):
    """When the command is followed, a container has come down on each cube, and only the container
    can be lifted. So each phrase for the first color begins with it."""
    for scenario in task_scenarios(task).scenarios:
        for text in scenario.texts["say.colors.0"]:
            assert literal(text).startswith("the container over ")


def test_a_place_before_containers_move_is_said_to_be_one_at_the_start():
    """In VideoUnmaskSwap containers change places in the video. *The container that started in the
    back* is elsewhere when the command is heard. So each scenario that names a place (all of the
    setting *spatial*, and others with a clue to exclude) says that it was so at the start."""
    at_the_start = "start|beginning|early in the video|before .* moved|as soon as they moved"
    for scenario in task_scenarios("VideoUnmaskSwap").scenarios:
        if scenario.fields.setting == "spatial" or "aside" in str(scenario.texts):
            said = literal(scenario.text("introduction")) + literal(scenario.text("say.colors.0"))
            assert re.search(at_the_start, said), said


def test_words_of_a_task_without_moving_containers_do_not_speak_of_following_one():
    """In ButtonUnmask containers stay where they come down, so no text may say that somebody lost
    track of one, as in a shell game."""
    moved = r"follow|keep(?:ing)? (?:up|track)|los(?:es?|t|ing) track|shell game"
    for scenario in task_scenarios("ButtonUnmask").scenarios:
        for text in itertools.chain.from_iterable(scenario.texts.values()):
            assert not re.search(moved, literal(text)), scenario.fields.frame


def test_the_latter_may_follow_one_cube_named_by_place_and_one_by_color():
    """Two cubes are meant: *I get the cube in the back, and Mia gets the red cube. Lift the
    container over mine, then the one over Mia's.* Mine is the first cube, which has a place, and
    Mia's the second, which has a color; the class *latter* says that a pointer means the second of
    two. The checker must find scenes that the story fits, where it means the goal and breaks no
    rule."""
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

    report = report_on(text, "ButtonUnmask", every=5)

    assert report.fitting
    assert not report.broken


def test_his_or_hers_may_stand_for_the_color_that_a_person_wants():
    """*Leo wants the red cube, and Mia wants the blue one. Do his: lift it …* The mark {hers} is
    said as *his* or *hers*. The checker must find no broken rule, and one of the texts that it
    renders must say one of the two."""
    text = """
tasks = ["PickXtimes"]
[[scenario]]
frame = "two"
pool = "test"
setting = "direct-rival"
list = "color"
introduction = "{person} wants the {list.0} cube, and {person.2} wants the {list.1} one."
say.color = ["<it color: it>"]
remarks.former = "Do <former list.0: {hers}>: "
remarks.latter = "Do <latter list.1: the latter>: "
remarks.not_former = "Not <former list.0: {hers}>: "
remarks.not_latter = "Not <latter list.1: the latter>: "
"""
    report = report_on(text, every=4)

    assert not report.broken
    assert any(re.search(r" (?:his|hers): ", said) for said in report.renderings)


def competing_remarks(scenario):
    """Return a scenario's remarks about a cube of another color, as they are written."""
    remarks = [literal(text) for text in scenario.texts.get("competing", ())]
    return [remark for remark in remarks if "{rival color" in remark]


each_task_with_remarks = pytest.mark.parametrize(
    "task", ["PickXtimes", "SwingXtimes", "VideoUnmask", "ButtonUnmaskSwap"]
)


@each_task_with_remarks
def test_a_remark_about_another_cube_places_it_away_from_the_table(task):
    """*The green one I had last year*, and not *the green one*, which could be on the table."""
    elsewhere = r"last|year|yesterday|home|at work|used to|his|her\b|their|old"
    for scenario in task_scenarios(task).scenarios:
        for remark in competing_remarks(scenario):
            assert re.search(elsewhere, remark, re.IGNORECASE), remark


@each_task_with_remarks
def test_after_a_remark_about_another_cube_the_cue_does_not_say_that_cube(task):
    """After *It's nicer than my green one*, *that cube* would be the green one."""
    for scenario in task_scenarios(task).scenarios:
        if competing_remarks(scenario):
            assert "that cube" not in literal(scenario.text("cue")), scenario.fields.frame


@each_pool
def test_the_one_i_mentioned_always_says_where_it_was_mentioned(pool):
    """Commands may say *the one I mentioned to Leo* or *in my mail*. Without a person or a place it
    could be the one of a competing remark, which is about a color that is not wanted."""
    phrases = []
    for scenario in scenarios_of(pool):
        phrases += scenario.texts.get("say.color", ())
        phrases += scenario.texts.get("say.colors.0", ())
    mentioned = [literal(text) for text in phrases if "I mentioned" in literal(text)]

    assert mentioned
    assert [words for words in mentioned if not re.search("I mentioned (to|in) ", words)] == []


def test_the_other_one_may_mean_the_moment_that_was_not_named():
    """There are two moments, before and after the press of a button. The story names one ({taken})
    as gone, so that *the other one* is the one that is meant. The checker must find scenes that the
    story fits, and no broken rule."""
    text = """
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
    report = report_on(text, "VideoPlaceButton", every=10)
    assert report.fitting
    assert not report.broken


def test_the_other_one_is_refused_if_two_of_three_colors_could_be_meant():
    """*The green cube is gone. … The other one*: of three colors two are left, so the checker must
    report that the words leave several goals, and that *the other one* stands for no single
    value."""
    text = """
tasks = ["VideoPlaceButton"]
[[scenario]]
frame = "gone"
pool = "test"
setting = "reasoning"
derive.pattern = "contextual logic"
list = "color"
introduction = "The {taken} cube is gone."
say.color = ["<other taken: the other one>"]
"""
    broken = report_on(text, "VideoPlaceButton", every=10).broken
    assert "means no goal, another one, or several" in broken
    assert "say.color must stand for the goal's value; it stands for blue or red" in broken
