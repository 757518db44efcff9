"""Settings that another package brings: they appear in lists, plans, statistics and exports.

A setting is a way to leave values of a goal unsaid, such as *direct*, which says *it* for a cube.
"""

import dataclasses

import pytest
import seed_selection
from seed_selection import EpisodeSlot, check_words

from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import (
    FORMS,
    expressible,
    find_refusals,
    instruct,
    setting_names,
    settings,
)
from roboirg.language.generator import find_refusal
from roboirg.language.instruction_row import row
from roboirg.language.scenarios.scenario_file import FOLDER, setting_scenarios
from roboirg.language.scenarios.wording_file import parse_wordings
from roboirg.language.scenarios.wording_store import register_wordings
from roboirg.language.settings import all_settings, contextual, direct, settings_of
from roboirg.language.settings.setting import Setting
from roboirg.language.variants import instructions
from roboirg.shortcuts.command_chance import understood_goals
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode

EASY_EPISODE = get_episode("PickXtimes", "test", 0)
HARD_EPISODE = get_episode("PickXtimes", "test", 3)
"""Its goal is to put the blue cube on the target four times."""
TOO_EASY = "the scene is too easy"
DUMMY = Setting(
    name="dummy",
    order=9,
    summary="direct, but not in easy scenes",
    color="#123456",
    content_plans="contextual",
    applies_to=lambda task: task.suite == "counting",
    refusal=lambda request: TOO_EASY if request.episode.difficulty == "easy" else None,
    example=0,
)
"""A setting for the tasks of one suite, which refuses easy scenes."""


@pytest.fixture
def register(monkeypatch):
    """A function that adds settings to those of the language for the length of a test."""
    found = dict(all_settings())

    def add(*more):
        added = {setting.name: setting for setting in more}
        monkeypatch.setattr(settings, "discover", lambda *_: {**found, **added})
        all_settings.cache_clear()
        setting_scenarios.cache_clear()

    yield add
    monkeypatch.undo()
    all_settings.cache_clear()
    setting_scenarios.cache_clear()


def test_a_registered_setting_is_listed_last(register):
    """DUMMY, a setting named "dummy", has the order 9, and ours have lower ones."""
    register(DUMMY)
    assert setting_names()[-1] == "dummy"


def test_a_registered_setting_is_one_of_the_tasks_it_applies_to(register):
    """DUMMY, a setting named "dummy", applies to the four tasks of the suite *counting*."""
    register(DUMMY)
    tasks = [name for name, task in all_tasks().items() if "dummy" in settings_of(task)]
    assert sorted(tasks) == ["BinFill", "PickXtimes", "StopCube", "SwingXtimes"]


def test_a_task_that_a_registered_setting_does_not_apply_to_refuses_it(register):
    """DUMMY, a setting named "dummy", is for the suite *counting*, to which VideoUnmask does not
    belong."""
    register(DUMMY)
    with pytest.raises(InvalidValueError, match="has no dummy setting"):
        instruct(get_episode("VideoUnmask", "test", 0), "dummy")


def test_a_scene_that_a_registered_setting_refuses_cannot_be_expressed_in_it(register):
    """DUMMY, a setting named "dummy", refuses easy scenes with the words *the scene is too
    easy*."""
    register(DUMMY)

    assert "dummy" in expressible(HARD_EPISODE)
    assert "dummy" not in expressible(EASY_EPISODE)
    assert find_refusals(EASY_EPISODE)["dummy"] == "the scene is too easy"


def test_the_reason_why_a_setting_refuses_a_scene_is_in_the_error(register):
    """DUMMY, a setting named "dummy", refuses easy scenes with the words *the scene is too
    easy*."""
    register(DUMMY)
    complaint = "dummy setting cannot express .*the scene is too easy"
    with pytest.raises(InvalidValueError, match=complaint):
        instruct(EASY_EPISODE, "dummy")


def test_an_episode_that_one_of_our_settings_refuses_would_not_be_published(register, monkeypatch):
    """A seed becomes an episode only if each of ACCEPTANCE_SETTINGS can express it. DUMMY, whose
    name is "dummy", refuses easy scenes; it is made one of them here. So the seed of an easy
    episode is rejected, with the reason that DUMMY gives."""
    register(DUMMY)
    monkeypatch.setattr(seed_selection, "ACCEPTANCE_SETTINGS", ("direct", "dummy"))

    rejection = check_words(EpisodeSlot("PickXtimes", "test", 0), EASY_EPISODE.seed)

    assert rejection.reason == "not expressible"
    assert rejection.cause == "dummy: the scene is too easy"


def test_exported_rows_include_a_registered_setting_in_both_forms(register):
    """DUMMY, whose name is "dummy", refuses easy scenes. So of an easy and a hard episode only the
    hard one has rows of it: one that says *it* (implicit), and one that says what *it* is
    (resolved)."""
    register(DUMMY)

    told = instructions([EASY_EPISODE, HARD_EPISODE], setting_names(), FORMS)

    rows = [row(episode, said) for episode, said in told]
    assert [exported["form"] for exported in rows if exported["setting"] == "dummy"] == [
        "implicit",
        "resolved",
    ]


EACH_SETTING_WITH_SCENARIOS = pytest.mark.parametrize(
    "name", ["direct", "reasoning", "spatial", "grounded", "direct-rival"]
)


@EACH_SETTING_WITH_SCENARIOS
def test_a_copy_of_a_setting_without_a_file_of_words_is_refused(name, register):
    """A setting's scenarios are written for it by name. A copy of one of ours has another name,
    *lab-…*, and no file of its own, so our file has no scenario for it."""
    register(dataclasses.replace(all_settings()[name], name=f"lab-{name}"))
    lacking = r"\): color_and_number\.toml has no lab-\S+ scenario for it in the pool test; leave"
    with pytest.raises(InvalidValueError, match=lacking):
        instruct(get_episode("PickXtimes", "test", 6), f"lab-{name}")


@pytest.fixture
def add_copy(register, tmp_path):
    """A function that adds a copy of one of our settings, `lab-NAME`, with a file of its own.

    The file is a copy of ours, with the name of the copied setting in its scenarios.
    """

    def add(name):
        path = tmp_path / "lab.toml"
        ours = (FOLDER / "color_and_number.toml").read_text()
        path.write_text(ours.replace(f'setting = "{name}"', f'setting = "lab-{name}"'))
        register(dataclasses.replace(all_settings()[name], name=f"lab-{name}", words=str(path)))

    return add


@EACH_SETTING_WITH_SCENARIOS
def test_a_setting_modeled_on_ours_speaks_the_scenarios_of_its_own_file(name, add_copy):
    """`add_copy` registers a copy of one of our settings, *lab-NAME*, with a file of its own, in
    which our scenarios bear its name. What it says must mean the goal, and be of one of the file's
    scenarios for tests, since the episode is one."""
    add_copy(name)
    episode = get_episode("PickXtimes", "test", 6)
    scenarios = setting_scenarios(f"lab-{name}")["PickXtimes"].scenarios
    for_tests = [found.fields.frame for found in scenarios if found.fields.pool == "test"]

    for form in FORMS:
        said = instruct(episode, f"lab-{name}", form)
        assert understood_goals(said, episode) == (episode.goal,), said.text
        assert said.metadata["scenario"] in for_tests, said.text


@pytest.mark.parametrize("name", ["explicit", "contextual"])
def test_copies_of_the_settings_explicit_and_contextual_give_the_same_commands(name, register):
    """A copy *my-…* of either setting needs no scenarios of its own: *explicit* has none,
    *contextual* uses those of *direct*. So it says what the original says."""
    register(dataclasses.replace(all_settings()[name], name=f"my-{name}"))
    assert instruct(HARD_EPISODE, f"my-{name}").turns == instruct(HARD_EPISODE, name).turns


LAB_FILE = """
tasks = ["PickXtimes"]
[commands]
all = ["Lab: lift {color} {repeats}."]
[stated.all]
color = "the lab's {color} cube"
[[scenario]]
frame = "lab"
pool = "test"
setting = "lab"
introduction = "The lab says {repeats:times}."
say.repeats = ["<each repeats: [repeats: once for that lap|once for each of them]>"]
"""


@pytest.fixture
def add_lab(register, tmp_path):
    """A function that adds a setting "lab", like *direct*, with a file of this text."""

    def add(text):
        path = tmp_path / "lab.toml"
        path.write_text(text)
        register(dataclasses.replace(direct.SETTING, name="lab", words=str(path)))

    return add


def registered_file_of_a_user(words):
    """Register a user's word file for PickXtimes with these words; return its identity."""
    text = f'name = "mine"\ntasks = ["PickXtimes"]\n{words}\n'
    return register_wordings(parse_wordings(text, "mine.toml"))


@pytest.mark.parametrize(
    ("words_of_user", "introduction", "command"),
    [
        (
            '[commands]\nall = ["Mine: lift {color} {repeats}."]',
            "The lab says four times.",
            "Mine: lift the lab's blue cube ",
        ),
        (
            '[stated.all]\ncolor = "my {color} cube"',
            "The lab says four times.",
            "Lab: lift my blue cube ",
        ),
        (
            """
[[scenario]]
frame = "mine"
setting = "lab"
introduction = "I say {repeats:times}."
say.repeats = ["<each repeats: [repeats: once for that lap|once for each of them]>"]
""",
            "I say four times.",
            "Lab: lift the lab's blue cube ",
        ),
    ],
    ids=["command", "phrase", "introduction"],
)
def test_words_of_a_user_file_win_over_those_of_a_setting(
    add_lab, words_of_user, introduction, command
):
    """The blue cube is to be lifted four times. LAB_FILE has the words of the setting *lab*: the
    introduction *The lab says four times*, the command *Lab: lift …* and the phrase *the lab's blue
    cube* for a value. A user's file brings one of the three; the others stay the setting's."""
    add_lab(LAB_FILE)
    wordings = registered_file_of_a_user(words_of_user)

    said = instruct(HARD_EPISODE, "lab", wordings=wordings)

    assert said.turns[0] == introduction
    assert said.command.startswith(command)


def test_other_settings_do_not_use_a_setting_s_own_file(add_lab):
    """LAB_FILE has the words of the setting *lab*, as in *Lab: lift the lab's blue cube*. Another
    setting says none of them, neither with our words nor with those of a user's file."""
    add_lab(LAB_FILE)
    wordings = registered_file_of_a_user('[commands]\nall = ["Mine: lift {color} {repeats}."]')

    assert "Lab" not in instruct(HARD_EPISODE).text
    assert instruct(HARD_EPISODE, wordings=wordings).text == "Mine: lift the blue cube four times."


@pytest.mark.parametrize(
    "text",
    [f'name = "lab"\n{LAB_FILE}', f'{LAB_FILE}[[literal]]\ntask = "PickXtimes"\ntext = "x"\n'],
    ids=["name", "whole sentence"],
)
def test_the_word_file_of_a_setting_with_a_name_or_a_whole_sentence_is_refused(add_lab, text):
    """LAB_FILE is a right file of words of a setting. A name, or a whole sentence ([[literal]]),
    belongs into files of users only."""
    add_lab(text)
    with pytest.raises(InvalidValueError, match=r"^lab\.toml has a name or a \[\[literal"):
        instruct(HARD_EPISODE, "lab")


@pytest.mark.parametrize(("first", "index"), [("direct", 900_001), ("calm", 900_002)])
def test_a_cached_choice_of_one_setting_does_not_answer_for_another(register, first, index):
    """*Calm* is a copy of *contextual*, which says the scenarios of *direct*, but refuses every
    episode. The scenario that is chosen for an episode is cached, for both. So whichever of the two
    is asked first about an episode that no other test uses, each must give its own answer."""
    calm = dataclasses.replace(contextual.SETTING, name="calm", refusal=lambda _: "never calm")
    register(calm)
    episode = get_episode("PickXtimes", "random", index)

    find_refusal(episode, InstructionOptions(first))

    assert find_refusal(episode, InstructionOptions("calm")) == "never calm"
    assert find_refusal(episode, InstructionOptions("direct")) is None
