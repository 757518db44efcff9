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
OWN, PLACES = re.findall(r"```toml\n(.*?)```", (DOCS / "add-scenario.md").read_text(), re.DOTALL)
"""The page's examples: a file of a user's own, and two spatial scenarios."""
DIRECT = OWN.replace('name = "mine"\n', "").replace("setting", 'pool = "train"\nsetting')
"""The first one as a file of ours."""
RIVAL = """
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
UNSEEN = "nothing to see in this scene singles out a slot's value"
UNRIVALED = "a goal that counts cubes of several colors leaves no rival"
YEARS = "[repeats: once for that year|once for each year]"


def read(text, task="PickXtimes"):
    """Return what a file says of a task."""
    return read_task_scenarios(text, "mine.toml")[task]


def spoken(task):
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
def test_a_file_with_a_mistake_is_refused_by_file_scenario_and_field(before, after, complaint):
    assert before in DIRECT
    with pytest.raises(InvalidValueError, match=r"^mine\.toml") as found:
        read(DIRECT.replace(before, after))
    assert complaint in str(found.value)


STEP = "{step} fewer [step: time|times] than <that reference: {he} did>"


def test_of_a_pointer_that_does_not_exist_the_five_nearest_are_named_each_once():
    with pytest.raises(InvalidValueError) as found:
        read(DIRECT.replace('["<it color: it>"]', f'["{STEP}"]'))

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


def test_the_page_lists_every_pointer():
    lines = (DOCS / "scenario-marks.md").read_text().splitlines()
    table = lines[lines.index("| stands for | follows by | words |") + 2 :]
    assert sorted(table) == pointer_lines()


def test_every_mistake_of_a_file_is_named_by_scenario_and_field():
    wrong = DIRECT.replace('"train"', '"dev"').replace("\ncue", "\nclue")
    wrong = wrong.replace("{repeats} today", "{repeat} today").replace("{color} c", "{colr} c")
    wrong = wrong.replace("<it color: it>.", "<them color: it>")
    again = RIVAL.replace("not_latter", "latest").partition("\n[")[2]

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
        (DIRECT, "turns {repeats} today and ", "", "points at what the"),
        (DIRECT, "wants to", "has a {color} one and wants to", "has 2 antecedents"),
        (DIRECT, "Let's surprise", "You saw this. Surprise", "what was seen is not checked"),
        (DIRECT, "The cake", "The second cake", "names second, which could be a value"),
        (DIRECT, "The cake", "Look at that cake", "may be covered"),
        (DIRECT, 'say.color = ["', 'lead = "Twice: "\nsay.color = ["', "names twice"),
        (DIRECT, 'say.color = ["', 'lead = "Twice: "\nsay.color = ["', "gives away twice"),
        (DIRECT, "The cake", "The cake " + "is so very good " * 9, "only 64 are heard"),
        (DIRECT, "{rival color} one", "{rival color} one {list}",
         "a competing remark with a value for list or rival color in this"),
        (DIRECT, "{rival color}", "{rival visit}", "known: aside.0"),
        (RIVAL, "Not <former list.0: the", "Not <latter list.1: the", "the class 'former' for a"),
        (RIVAL, "Do <former list.0: the former>", "Do <latter list.1: the latter>", "first point"),
        (FEWER, PHOTOS, "once for each of them", "say.repeats must stand"),
        (FEWER, " {reference:photo}", "", "says the same of another goal"),
        (FEWER, "once for each", "once per", "which does not exist"),
        *((DIRECT, "The cake", f"{words}, the cake", f"names {words.lower()}")
          for words in ("Twice", "On the left", "Once", "Four")),
    ],
)  # fmt: skip
def test_the_checker_names_the_rule_that_a_scenario_breaks(text, before, after, rule):
    scenes = scenes_of("PickXtimes", 0)[::10]
    assert not check_scenarios(read(text), None, scenes)[0].broken
    assert before in text

    try:
        words = read(text.replace(before, after))
        broken = list(check_scenarios(words, None, scenes)[0].broken)
    except InvalidValueError as error:  # said no expression of the table
        broken = [str(error)]
    assert any(rule in sentence for sentence in broken), broken


def test_a_value_after_pointers_and_a_place_are_given_away_and_pointers_are_not():
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


def test_that_one_is_no_number_but_one_time_is():
    said = instruct(get_episode("PickXtimes", "test", 3), "direct")
    for words, leaks in {
        "Lift the one before that one.": set(),
        "Move it over both targets.": set(),
        "Lift it one time.": {"one"},
    }.items():
        command = replace(said.utterances[-1], text=words)
        telling = replace(said, utterances=(*said.utterances[:-1], command), mentions=())
        assert find_leaks(telling, Goal.of(color="red", repeats=1)) == leaks


@pytest.mark.parametrize(("text", "setting"), [(DIRECT, "direct"), (FEWER, "reasoning")])
def test_one_more_scenario_moves_no_text_but_those_that_say_it(text, setting):
    (added,) = read(text).scenarios
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


def test_the_example_of_the_page_breaks_no_rule_in_any_scene():
    (report,) = check_scenarios(read(DIRECT), None, scenes_of("PickXtimes"))
    assert not report.broken


def test_the_page_s_file_is_one_of_ones_own_and_its_two_places_serve_every_scene():
    scenes = scenes_of("PickXtimes", 0)[::4]
    words = parse_wordings(OWN + PLACES, "mine.toml").tasks["PickXtimes"]

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
def test_of_a_scenario_that_fits_no_scene_the_reason_is_given(text, before, after, reason):
    scenes = scenes_of("PickXtimes", 0)[:3]
    (report,) = check_scenarios(read(text.replace(before, after)), None, scenes)

    fits_none = f"fits none of the scenes; in PickXtimes/train/0 {reason}"

    assert [rule[: len(fits_none)] for rule in report.broken][-1:] == [fits_none]


def test_authors_see_a_competing_remark_where_a_setting_has_one():
    scenes = scenes_of("PickXtimes", 0)[::20]
    for text, number in ((DIRECT, 1), (RIVAL, 0)):
        (report,) = check_scenarios(read(text), None, scenes)
        (*texts, _, _) = report_lines(report, "PickXtimes")
        shown = [text for text in texts if text.startswith("  With a competing remark: ")]
        assert len(shown) == number
        assert all(" one. Let's surprise" in text for text in shown)


CONTAINER = """
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
def test_words_for_a_container_that_point_at_its_cube_name_the_container(words, is_broken):
    scenario = read(CONTAINER.replace("WORDS", words), "VideoUnmask").scenarios[0]
    broken = any(
        "a container is lifted" in sentence for sentence in broken_sentences(scenario, "container")
    )
    assert broken == is_broken


def test_a_resolved_text_that_is_too_long_is_marked():
    longer = "<it color: it> is much prettier than {person.2}'s {rival color} one."
    text = DIRECT.replace("{person.2} has a {rival color} one.", longer)
    (report,) = check_scenarios(read(text), None, scenes_of("PickXtimes"))

    (*_, complaint, example, _) = report_lines(report, "PickXtimes")

    assert re.match(r"  BROKEN needs \d+ tokens; only 64 are heard", complaint)
    assert re.match(r"    resolved: .*Pick up the \w+ cube and put it on the target", example)


def test_words_that_only_look_like_a_value_may_be_said_and_people_only_in_passing():
    words = (
        "All right, right now it's left at home. Once we're done, at once. Just a second, the cake"
    )
    text = DIRECT.replace("The cake", words).replace("{person} turns", "My cat turns")
    text = text.replace("{he}", "it").replace("surprise {him}", "surprise it")
    scenes = scenes_of("PickXtimes", 0)[::20]

    (report,) = check_scenarios(read(text), None, scenes)

    assert not set(report.broken) - {f"needs {tokens_of(report.longest)} tokens; only 64 are heard"}


@pytest.mark.parametrize("task", WRITTEN)
@pytest.mark.parametrize("step", [25, pytest.param(1, marks=pytest.mark.slow)])
def test_no_scenario_breaks_a_rule_in_published_and_random_scenes(task, step):
    reports = check_scenarios(task_scenarios(task), None, scenes_of(task)[::step])
    broken = {
        report.scenario.fields.frame: dict(report.broken) for report in reports if report.broken
    }
    assert step > 1 or not broken

    rules = {rule.partition(";")[0] for found in broken.values() for rule in found}
    assert rules <= {"fits none of the scenes"}, broken


@pytest.mark.parametrize("task", WRITTEN)
def test_every_published_scene_has_words_in_both_pools(task):
    for episode, name, pool in itertools.product(scenes_of(task, 0), all_settings(), POOLS):
        if name in settings_of(get_task(task)):
            refused = find_refusal(episode, InstructionOptions(name, wordings=pool))
            known = {"grounded": (None, UNSEEN), "direct-rival": (None, UNRIVALED)}
            assert refused in known.get(name, (None,)), (episode.key, name, pool)


def test_nobody_needs_several_cubes_where_one_is_to_be_put_into_the_bin():
    """*I need more cubes like the one on the left. So put one like that one into the bin.*"""
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
def test_instructions_keep_the_rules(task):
    commands = {}
    for episode, options, told in spoken(task):
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
def test_of_several_amounts_one_color_has_to_be_found_out_and_the_others_are_stated(name):
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


def test_all_amounts_are_said_in_one_phrase_each_count_and_color_a_mention():
    scenes = scenes_of("BinFill", 0)
    episode = next(scene for scene in scenes if len(scene.goal["colors"]) == 3)
    said = instruct(episode)
    assert re.search(r"\w+ red cubes?, \w+ blue ones? and \w+ green ones? ", said.text)

    values = [mention.value for mention in said.mentions]
    assert values == [value for color, count in episode.goal.amounts for value in (count, color)]


def test_a_clue_that_sets_two_things_aside_has_a_sentence_for_them():
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
def test_a_long_context_begins_with_the_shorter_one(kind):
    episode = get_episode("PickXtimes", "train", 2)
    few, many = (
        instruct(episode, "contextual", distractor=kind, distractors=number).turns
        for number in (2, 9)
    )
    assert (many[:4], many[-2:], len(many)) == (few[:4], few[-2:], 13)


def test_each_arm_says_other_words_of_a_scenario():
    episode = get_episode("PickXtimes", "train", 2)
    options = InstructionOptions("direct")
    told = instruct_with(episode, options).text

    arms = [say_arm(episode, options, arm) for arm in ("paraphrase-1", "other-goal", "scrambled")]

    assert len({told, *(arm.instruction.text for arm in arms)}) == 4


def test_a_task_without_words_is_refused_in_a_sentence(monkeypatch):
    take_words(monkeypatch, "VideoRepick")
    lacking = "has no commands of VideoRepick in the pool train."

    with pytest.raises(InvalidValueError, match=lacking):
        read(DIRECT.replace("PickXtimes", "VideoRepick"))
    with pytest.raises(InvalidValueError, match="VideoRepick names no file of words"):
        instruct(get_episode("VideoRepick", "test", 0), "direct")


TWO_TASKS = """
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


def test_a_file_serves_several_tasks_each_with_its_own_commands_and_scenarios():
    pick = read(TWO_TASKS)
    swing = read(TWO_TASKS, "SwingXtimes")

    assert pick.commands["train"] == swing.commands["train"] == ("Move {color} {repeats}.",)
    assert pick.commands["test"] == ("Take {color} {repeats}.",)
    assert swing.commands["test"] == ("Swing {color} {repeats}.",)
    assert pick.stated["color"] == swing.stated["color"]
    assert pick.stated["repeats"] != swing.stated["repeats"]
    assert [scenario.fields.frame for scenario in pick.scenarios] == ["here"]
    assert [scenario.fields.frame for scenario in swing.scenarios] == ["here", "there"]


def test_a_file_without_commands_has_those_of_each_task():
    text = TWO_TASKS.partition("[commands.all]")[0] + DIRECT.partition("\n")[2]
    for task in ("PickXtimes", "SwingXtimes"):
        own = task_scenarios(task)
        assert read(text, task).commands == own.commands
        (scenario,) = read(text, task).scenarios
        assert scenario not in own.scenarios


SIMILAR = 0.7
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


def test_every_pointer_is_said_in_both_pools():
    """A pointer that one pool lacks would be new to whoever learned from the other one."""
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


def test_no_implicit_text_of_the_test_split_is_said_in_training():
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


def test_no_frame_is_in_both_pools_or_twice_in_one():
    """Sentences are compared by the checker, which compares with all tasks."""
    frames = [scenario.fields.frame for pool in POOLS for scenario in scenarios_of(pool)]
    assert len(frames) == len(set(frames))


def test_no_introduction_of_a_test_is_one_of_training_with_other_nouns():
    def words_of(scenario):
        introduction = literal(scenario.text("introduction")).lower()
        return re.findall(r"[\w']+", re.sub(r"\{[^}]*\}", "_", introduction))

    known = [words_of(scenario) for scenario in scenarios_of("train")]
    for scenario in scenarios_of("test"):
        words = words_of(scenario)
        for other in known:
            alike = difflib.SequenceMatcher(None, words, other, autojunk=False).ratio()
            assert alike < SIMILAR, (words, other)


def test_nobody_says_that_many_times_of_one():
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


ONE_STEP = """
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
def test_words_for_both_directions_mean_that_of_the_relations_of_their_scenario(relation, way):
    text = ONE_STEP.replace("one earlier", relation).replace("back", way)
    scenes = scenes_of("VideoPlaceOrder", 0)[::4]

    (report,) = check_scenarios(read(text, "VideoPlaceOrder"), None, scenes)

    assert report.scenes > report.broken.total() == 0
    assert all(f"go {way} one. " in text for text in report.renderings)


def test_where_nothing_is_said_of_one_the_command_has_no_gap():
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
    """*Once for that run* is one, and *once for each run* would be two: a command with one of them
    leaves the color at least."""
    scenarios = task_scenarios("PickByCount").scenarios
    for scenario in scenarios:
        said = str(scenario.texts.get("say.repeats", ()))
        assert "Agreement" not in said or scenario.said == ("color", "repeats"), scenario.fields


def test_any_of_the_asides_of_a_scenario_can_be_said_before_the_others():
    found = defaultdict(set)
    for index in range(240):
        episode = get_episode("StopCube", "random", index)
        said = instruct_with(episode, InstructionOptions("contextual"))
        (aside,) = (
            utterance.text for utterance in said.utterances if utterance.stage == "distractor"
        )
        found[said.metadata["scenario"]].add(re.sub(r"^(?:He|She)", "", aside))
    assert all(len(asides) == 3 for asides in found.values()), found


def test_a_list_and_a_position_in_it_before_the_command_give_the_value():
    """*It's the second one's turn, so lift the container over it.*"""
    words = task_scenarios("VideoUnmask")
    scenes = scenes_of("VideoUnmask", 0)[::10]

    (report,) = check_scenarios(words, "video series", scenes)

    assert report.scenes > report.broken.total() == 0


@pytest.mark.parametrize("task", ["ButtonUnmask", "ButtonUnmaskSwap"])
def test_before_containers_stand_only_cubes_are_spoken_of(task):
    for scenario in task_scenarios(task).scenarios:
        texts = {name: text for name, text in scenario.texts.items() if "say." not in name}
        for text in itertools.chain.from_iterable(texts.values()):
            assert not re.search("container|hidden|watched|where .* went", literal(text))
        for text in scenario.texts["say.colors.0"]:
            assert literal(text).startswith("the container over ")


def test_a_place_at_the_start_of_the_video_is_not_called_a_place_of_now():
    for scenario in task_scenarios("VideoUnmaskSwap").scenarios:
        said = f"{literal(scenario.text('introduction'))} {literal(scenario.text('say.colors.0'))}"
        if scenario.fields.setting == "spatial" or "aside" in str(scenario.texts):
            assert re.search("start|beginning|before .* moved|as soon as they moved", said)


def test_positions_count_cubes_that_are_named_by_color_and_by_place():
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

    (report,) = check_scenarios(read(text, "ButtonUnmask"), None, scenes)

    assert report.scenes > report.broken.total() == 0


def test_a_person_stands_for_what_he_or_she_wants():
    text = RIVAL.replace("We have", "{person} wants").replace("they still sell", "{person.2} wants")
    text = text.replace("<former list.0: the former>", "<former list.0: {hers}>")
    words = read(text)

    (report,) = check_scenarios(words, None, scenes_of("PickXtimes", 0)[::4])

    assert not report.broken
    assert any(re.search(r" (?:his|hers): ", text) for text in report.renderings)


def test_where_no_container_moves_none_is_followed():
    moved = r"follow|keep(?:ing)? (?:up|track)|los(?:es?|t|ing) track|shell game"
    for scenario in task_scenarios("ButtonUnmask").scenarios:
        texts = itertools.chain.from_iterable(scenario.texts.values())
        assert not re.search(moved, " ".join(map(literal, texts))), scenario.fields.frame


ELSEWHERE = r"last|year|yesterday|home|at work|used to|his|her\b|their|old"
"""Words of a cube that is not on the table."""


@pytest.mark.parametrize("task", ["PickXtimes", "SwingXtimes", "VideoUnmask", "ButtonUnmaskSwap"])
def test_a_competing_cube_is_elsewhere_and_not_that_of_the_cue(task):
    """After *It's nicer than my green one*, *that cube* is the green one on the table."""
    for scenario in task_scenarios(task).scenarios:
        told = [literal(text) for text in scenario.texts.get("competing", ())]
        rivals = [text for text in told if "{rival color" in text]
        assert all(re.search(ELSEWHERE, text, re.IGNORECASE) for text in rivals), rivals
        assert not rivals or "that cube" not in literal(scenario.text("cue"))


def test_the_one_i_mentioned_is_the_one_that_was_mentioned_there():
    """A competing remark mentions another one, but not there."""
    for scenario in itertools.chain.from_iterable(map(scenarios_of, POOLS)):
        for texts in (scenario.texts.get(f"say.{name}", ()) for name in ("color", "colors.0")):
            said = " ".join(map(literal, texts))
            assert "I mentioned" not in said or re.search("I mentioned (?:to|in) ", said), said


MOMENTS = """
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


def test_of_two_moments_the_other_one_is_meant_though_only_one_is_named():
    words = read(MOMENTS, "VideoPlaceButton")
    (report,) = check_scenarios(words, None, scenes_of("VideoPlaceButton", 0)[::10])
    assert report.scenes > report.broken.total() == 0


def test_of_three_colors_the_other_one_is_open_if_only_one_is_named():
    text = MOMENTS.replace('"relation"', '"color"').replace(".relation", ".color")
    text = text.replace("target the robot used right {taken} pressing the button", "{taken} cube")
    text = text.replace("on <other taken: the other one it used>", "<other taken: the other one>")
    words = read(text, "VideoPlaceButton")
    (report,) = check_scenarios(words, None, scenes_of("VideoPlaceButton", 0)[::10])

    assert "means no goal, another one, or several" in report.broken

    either = "say.color must stand for the goal's value; it stands for blue or red"
    assert either in report.broken


def test_a_cube_and_a_moment_are_not_taken_for_each_other():
    words = task_scenarios("VideoPlaceButton")
    scenes = scenes_of("VideoPlaceButton", 0)[::10]

    (report,) = check_scenarios(words, "belongs there", scenes)

    assert report.scenes > report.broken.total() == 0


def test_a_target_may_be_called_there_though_it_has_moved():
    words = task_scenarios("VideoPlaceButton")
    scenes = scenes_of("VideoPlaceButton", 0)
    moved = [scene for scene in scenes if scene.scene.motions_of(Swap)][::5]

    (report,) = check_scenarios(words, "target to test", moved)

    assert report.scenes > report.broken.total() == 0


def test_a_target_on_one_side_is_no_target_with_words_that_point_back():
    scenes = scenes_of("VideoPlaceButton")
    (report,) = check_scenarios(
        task_scenarios("VideoPlaceButton"), "going with that target", scenes
    )

    assert any("target on the left" in text for text in report.resolved)
    assert not report.broken
