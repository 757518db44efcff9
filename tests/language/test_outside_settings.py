"""A setting from outside: one file is enough for lists, plans, statistics and export."""

import dataclasses
import io

import pytest
import seed_selection
from rich.console import Console
from seed_selection import EpisodeSlot, check_words

from roboirg.apps.language_lab import statistics_tables
from roboirg.apps.show.episode_text import instructions_table
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
from roboirg.language.number_words import times
from roboirg.language.scenarios import spoken
from roboirg.language.scenarios.scenario_file import FOLDER, setting_scenarios
from roboirg.language.scenarios.wording_file import parse_wordings
from roboirg.language.scenarios.wording_store import register_wordings
from roboirg.language.settings import all_settings, contextual, direct, settings_of
from roboirg.language.settings.setting import Setting
from roboirg.language.variants import instructions
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.shortcuts.command_chance import understood_goals
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode

EASY_EPISODE = get_episode("PickXtimes", "test", 0)  # easy
HARD_EPISODE = get_episode("PickXtimes", "test", 3)
TOO_EASY = "the scene is too easy"

NOT_FOR_EASY_SCENES = Setting(
    name="dummy",
    order=9,
    summary="direct, but not in easy scenes",
    color="#123456",
    content_plans="contextual",
    applies_to=lambda task: task.suite == "counting",
    refusal=lambda request: TOO_EASY if request.episode.difficulty == "easy" else None,
    example=0,
)


@pytest.fixture
def register(monkeypatch):
    """Adds settings to those of the language for the length of a test."""
    found = dict(all_settings())

    def add(*more):
        added = {setting.name: setting for setting in more}
        monkeypatch.setattr(settings, "discover", lambda *_: {**found, **added})
        all_settings.cache_clear()

    yield add
    monkeypatch.undo()
    all_settings.cache_clear()


def printed(*tables):
    console = Console(width=200, file=io.StringIO())
    for table in tables:
        console.print(table)
    return console.file.getvalue()


def test_a_registered_setting_is_listed_for_the_tasks_it_applies_to(register):
    """A setting is a way of giving commands; this one, "dummy", applies to the suite *counting*."""
    register(NOT_FOR_EASY_SCENES)
    counting = [task.name for task in all_tasks().values() if task.suite == "counting"]

    assert setting_names()[-1] == "dummy"
    assert [name for name, task in all_tasks().items() if "dummy" in settings_of(task)] == counting
    with pytest.raises(InvalidValueError, match="has no dummy setting"):
        instruct(get_episode("VideoUnmask", "test", 0), "dummy")


def test_the_reason_why_a_setting_refuses_a_scene_is_shown_everywhere(register):
    """The setting "dummy" refuses easy scenes; lists, errors, tables and plans must show that."""
    register(NOT_FOR_EASY_SCENES)
    assert "dummy" not in expressible(EASY_EPISODE)
    assert "dummy" in expressible(HARD_EPISODE)
    assert find_refusals(EASY_EPISODE)["dummy"] == TOO_EASY
    with pytest.raises(InvalidValueError, match=f"dummy setting cannot express .*{TOO_EASY}"):
        instruct(EASY_EPISODE, "dummy")
    assert TOO_EASY in printed(instructions_table(EASY_EPISODE, ["dummy"], InstructionOptions()))

    plan = make_plan(["listener"], tasks="PickXtimes", settings="all", episodes="0,3")
    assert ["dummy" in plan.settings_of("PickXtimes", index) for index in (0, 3)] == [False, True]


def test_a_registered_setting_does_not_change_which_episodes_are_published(register, monkeypatch):
    """Episodes were accepted if our own settings can express them; a new one has no say in this."""
    slot = EpisodeSlot("PickXtimes", "test", 0)
    register(NOT_FOR_EASY_SCENES)
    assert check_words(slot, EASY_EPISODE.seed) is None

    monkeypatch.setattr(seed_selection, "ACCEPTANCE_SETTINGS", ("direct", "dummy"))
    rejection = check_words(slot, EASY_EPISODE.seed)
    assert (rejection.reason, rejection.cause) == ("not expressible", f"dummy: {TOO_EASY}")


def test_statistics_and_exported_rows_include_a_registered_setting(register):
    """It refuses easy episodes, so it has two instructions (forms) for each of the others."""
    register(NOT_FOR_EASY_SCENES)
    episodes = [get_episode("PickXtimes", "test", index) for index in range(12)]

    jobs = list(instructions(episodes, setting_names(), FORMS))

    settings = [row(*job)["setting"] for job in jobs]
    harder = [episode for episode in episodes if episode.difficulty != "easy"]
    assert settings.count("dummy") == 2 * len(harder)
    said = [instruction for _, instruction in jobs if instruction.form == "implicit"]
    assert "dummy" in printed(*statistics_tables.overview_tables(said))


@pytest.mark.parametrize("name", ["direct", "reasoning", "spatial", "grounded", "direct-rival"])
def test_a_setting_modeled_on_ours_speaks_the_scenarios_of_its_own_file(name, register, tmp_path):
    """Scenarios are little stories around a command. A copy of one of our settings has none under
    its new name, until it names a file that has some."""
    add_lab = f"lab-{name}"
    episode = get_episode("PickXtimes", "test", 6)
    ours = (FOLDER / "color_and_number.toml").read_text()
    path = tmp_path / "lab.toml"
    path.write_text(ours.replace(f'setting = "{name}"', f'setting = "{add_lab}"'))
    setting = dataclasses.replace(all_settings()[name], name=add_lab)
    register(setting)
    unwritten = r"\): color_and_number\.toml has no lab-\S+ scenario for it in the pool test; leave"
    with pytest.raises(InvalidValueError, match=unwritten):
        instruct(episode, add_lab)

    register(dataclasses.replace(setting, words=str(path)))
    setting_scenarios.cache_clear()
    scenarios = setting_scenarios(add_lab)["PickXtimes"].scenarios
    of_the_pool = [scenario for scenario in scenarios if scenario.fields.pool == "test"]

    for form in FORMS:
        said = instruct(episode, add_lab, form)
        assert understood_goals(said, episode) == (episode.goal,)
        frame = said.metadata["scenario"]
        (scenario,) = [found for found in of_the_pool if found.fields.frame == frame]
        assert scenario.fields.setting == add_lab
    states_color = episode.goal.text("color") in said.command
    assert states_color or name not in ("direct", "direct-rival")

    setting_scenarios.cache_clear()


def test_copies_of_the_settings_explicit_and_contextual_give_the_same_commands(register):
    made = [
        dataclasses.replace(all_settings()[name], name=f"my-{name}")
        for name in ("explicit", "contextual")
    ]
    register(*made)
    for setting in made:
        usual = instruct(HARD_EPISODE, setting.name.removeprefix("my-"))
        assert instruct(HARD_EPISODE, setting.name).turns == usual.turns


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
MY_FILE_HEAD = 'name = "mine"\ntasks = ["PickXtimes"]\n'
MY_COMMAND = '[commands]\nall = ["Mine: lift {color} {repeats}."]\n'
MY_VALUE = '[stated.all]\ncolor = "my {color} cube"\n'
MY_SCENARIO = """
[[scenario]]
frame = "mine"
setting = "lab"
introduction = "I say {repeats:times}."
say.repeats = ["<each repeats: [repeats: once for that lap|once for each of them]>"]
"""


@pytest.fixture
def add_lab(register, tmp_path):
    """A setting with a file of its own, of which the test gives the text."""

    def add(text, **changes):
        path = tmp_path / "lab.toml"
        path.write_text(text)
        made = dataclasses.replace(direct.SETTING, name="lab", words=str(path), **changes)
        register(made)
        setting_scenarios.cache_clear()
        return made

    yield add
    setting_scenarios.cache_clear()


@pytest.mark.parametrize(
    ("mine", "introduction", "command"),
    [
        ("", "The lab says {}.", "Lab: lift the lab's {} cube "),
        (MY_COMMAND, "The lab says {}.", "Mine: lift the lab's {} cube "),
        (MY_VALUE, "The lab says {}.", "Lab: lift my {} cube "),
        (MY_SCENARIO, "I say {}.", "Lab: lift the lab's {} cube "),
        (MY_COMMAND + MY_VALUE + MY_SCENARIO, "I say {}.", "Mine: lift my {} cube "),
    ],
)
def test_words_of_a_user_file_win_over_those_of_a_setting_and_these_over_the_task_s(
    add_lab, mine, introduction, command
):
    """A user's file ("mine") may bring a command, a phrase for a value, or an introduction; what it
    lacks is taken from the setting's file ("lab"). Other settings ignore the lab's."""
    add_lab(LAB_FILE)
    wordings = register_wordings(parse_wordings(MY_FILE_HEAD + mine, "mine.toml")) if mine else None
    said = instruct(HARD_EPISODE, "lab", wordings=wordings)
    color = HARD_EPISODE.goal.text("color")

    assert said.turns[0] == introduction.format(times(HARD_EPISODE.goal["repeats"]))
    assert said.command.startswith(command.format(color))

    explicit = instruct(HARD_EPISODE, wordings=wordings).command
    assert "Lab" not in explicit
    assert explicit.startswith("Mine: ") == (MY_COMMAND in mine)


@pytest.mark.parametrize(
    "wrong", ['name = "lab"\n', '[[literal]]\ntask = "PickXtimes"\ntext = "x"\n']
)
def test_the_word_file_of_a_setting_with_a_name_or_a_whole_sentence_is_refused(add_lab, wrong):
    """Both belong into files of users only."""
    add_lab(wrong + LAB_FILE if "name" in wrong else LAB_FILE + wrong)
    with pytest.raises(InvalidValueError, match=r"^lab\.toml has a name or a \[\[literal"):
        instruct(HARD_EPISODE, "lab")


def test_a_cached_choice_of_one_setting_does_not_answer_for_another(register):
    """ "calm" is a copy of *contextual* with its own refusal; *direct* shares the cache with it."""
    calm = dataclasses.replace(contextual.SETTING, name="calm", refusal=lambda _: "never calm")
    register(calm)
    options = {name: InstructionOptions(name) for name in ("direct", "calm")}
    for names in (("direct", "calm", "direct"), ("calm", "direct", "calm")):
        spoken._CHOICES.clear()
        refused = {name: find_refusal(HARD_EPISODE, options[name]) for name in names}
        assert refused == {"direct": None, "calm": "never calm"}


def test_direct_and_contextual_share_one_cached_choice_of_scenario():
    spoken._CHOICES.clear()
    for name in ("direct", "contextual"):
        instruct(HARD_EPISODE, name)
        assert len(spoken._CHOICES) == 1
