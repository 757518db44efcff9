"""A setting from outside: one file is enough for validation, card, statistics and export."""

import dataclasses
import io
import re
import sys
from pathlib import Path

import pytest
import seed_selection
from language_variants import validated
from rich.console import Console
from seed_selection import EpisodeSlot, check_words

from roboirg.apps.language_lab import statistics_tables
from roboirg.apps.language_lab.validation import episode_checks
from roboirg.apps.language_lab.validation.episode_checks import check_episode
from roboirg.apps.language_lab.validation.validation_tables import validation_tables
from roboirg.apps.show.episode_text import instructions_table
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.language import (
    FORMS,
    LANGUAGE_VERSIONS,
    expressible,
    find_refusals,
    instruct,
    instruct_with,
    setting_names,
    settings,
)
from roboirg.language.instruction_row import row
from roboirg.language.phrases import plain
from roboirg.language.request import InstructionSpec, UtteranceSpec
from roboirg.language.scenarios.scenario_file import FOLDER, setting_scenarios
from roboirg.language.settings import all_settings, direct
from roboirg.language.settings.setting import Setting
from roboirg.language.variants import all_variants, instructions
from roboirg.shortcuts.command_chance import understood_goals
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode

EPISODE = get_episode("PickXtimes", "test", 0)  # easy
HARD = get_episode("PickXtimes", "test", 3)
REASON = "the scene is too easy"

DUMMY = Setting(
    name="dummy",
    order=9,
    summary="direct, but not in easy scenes",
    color="#123456",
    say=direct.say,
    applies_to=lambda task: task.suite == "counting",
    refusal=lambda request: REASON if request.episode.difficulty == "easy" else None,
    example=0,
)


@pytest.fixture
def register(monkeypatch):
    """Adds settings to those of the language for the length of a test."""
    found = tuple(all_settings().values())

    def add(*more):
        monkeypatch.setattr(settings, "discover", lambda *_: [*found, *more])
        all_settings.cache_clear()

    yield add
    monkeypatch.undo()
    all_settings.cache_clear()


def printed(*tables):
    console = Console(width=200, file=io.StringIO())
    for table in tables:
        console.print(table)
    return console.file.getvalue()


def test_a_setting_is_in_the_lists_of_its_tasks(register):
    before = len(all_variants())
    register(DUMMY)
    counting = [task.name for task in all_tasks().values() if task.suite == "counting"]
    assert setting_names()[-1] == "dummy"
    assert len(all_variants()) == before + len(counting)
    assert {one.task for one in all_variants() if one.setting == "dummy"} == set(counting)
    with pytest.raises(InvalidValueError, match="has no dummy setting"):
        instruct(get_episode("VideoUnmask", "test", 0), "dummy")


def test_a_refusal_says_why_wherever_it_shows(register):
    register(DUMMY)
    assert "dummy" not in expressible(EPISODE)
    assert "dummy" in expressible(HARD)
    assert find_refusals(EPISODE)["dummy"] == REASON
    with pytest.raises(InvalidValueError, match=f"dummy setting cannot express .*{REASON}"):
        instruct(EPISODE, "dummy")
    assert REASON in printed(instructions_table(EPISODE, ["dummy"], InstructionOptions()))
    plan = make_plan(["listener"], tasks="PickXtimes", settings="all", episodes="0,3")
    assert ["dummy" in plan.settings_of("PickXtimes", index) for index in (0, 3)] == [False, True]


def test_validation_counts_what_a_setting_refuses(register):
    register(DUMMY)
    results = validated("PickXtimes", "test", 4)
    assert not results.failures
    assert results.texts["PickXtimes", "dummy"] == 2 * 2
    assert results.refused["PickXtimes", "dummy", "", "easy"] == 2
    text = printed(*validation_tables(results))
    assert re.search(r"PickXtimes\s+dummy\s+2 of 2\b", text)
    assert f"dummy: {REASON}: 2 refusals" in text


def test_a_pairing_rule_of_a_setting_can_fail(register):
    def must_be_explicit(instruct):
        if instruct(InstructionOptions("dummy")).text != instruct(InstructionOptions()).text:
            yield "not explicit"

    register(dataclasses.replace(DUMMY, pairing_rules=must_be_explicit))
    (failure,) = check_episode(HARD).failures
    assert (failure.rule, failure.setting, failure.words) == ("pairing", "dummy", "not explicit")


def test_a_new_setting_does_not_change_the_splits(register, monkeypatch):
    slot = EpisodeSlot("PickXtimes", "test", 0)
    register(DUMMY)
    assert check_words(slot, EPISODE.seed) is None
    for module in (seed_selection, episode_checks):
        monkeypatch.setattr(module, "ACCEPTANCE_SETTINGS", ("direct", "dummy"))
    rejection = check_words(slot, EPISODE.seed)
    assert (rejection.reason, rejection.cause) == ("not expressible", f"dummy: {REASON}")
    strict = check_episode(EPISODE, must_be_expressible=True)
    assert [(one.rule, one.words) for one in strict.failures] == [("expressible", REASON)]


def test_statistics_and_export_have_the_setting(register):
    register(DUMMY)
    episodes = [get_episode("PickXtimes", "test", index) for index in range(12)]
    found = list(instructions(episodes, setting_names(), FORMS))
    dummies = [one for one in (row(*one) for one in found) if one["setting"] == "dummy"]
    assert len(dummies) == 2 * sum(episode.difficulty != "easy" for episode in episodes)
    said = [one for _, one in found if one.form == "implicit"]
    assert "dummy" in printed(*statistics_tables.overview_tables(said))


def test_language_4_leaves_a_setting_that_has_no_scenarios_its_own_words(register):
    def say(request):
        words = f"language {request.options.language}"
        return InstructionSpec((UtteranceSpec("command", plain(words)),))

    register(dataclasses.replace(DUMMY, say=say, reads=frozenset({"language"})))
    for language in (3, 4):
        said = instruct(HARD, "dummy", language=language)
        assert said.text == f"Language {language}"
        assert said.metadata["language_version"] == LANGUAGE_VERSIONS[language]


@pytest.mark.parametrize("name", ["direct", "reasoning", "spatial", "grounded", "direct-rival"])
def test_a_setting_says_scenarios_of_its_own_in_the_ways_of_one_of_ours(name, register, tmp_path):
    lab, episode = f"lab-{name}", get_episode("PickXtimes", "test", 6)
    ours = (FOLDER / "color_and_number.toml").read_text()
    path = tmp_path / "lab.toml"
    path.write_text(ours.replace(f'setting = "{name}"', f'setting = "{lab}"'))
    setting = dataclasses.replace(all_settings()[name], name=lab)
    register(setting)
    unwritten = r"\): color_and_number\.toml has no lab-\S+ scenario for it in the pool test; leave"
    with pytest.raises(InvalidValueError, match=unwritten):
        instruct(episode, lab, language=4)
    register(dataclasses.replace(setting, words=str(path)))
    setting_scenarios.cache_clear()
    for form in FORMS:
        said = instruct(episode, lab, form, language=4)
        assert understood_goals(said, episode) == (episode.goal,)
        (scenario,) = [
            one
            for one in setting_scenarios(lab)["PickXtimes"].scenarios
            if (one.fields.frame, one.fields.pool) == (said.metadata["scenario"], "test")
        ]
        assert scenario.fields.setting == lab
    states_color = episode.goal.text("color") in said.command
    assert states_color or name not in ("direct", "direct-rival")
    setting_scenarios.cache_clear()


def test_settings_made_from_explicit_and_contextual_say_what_these_do(register):
    made = [
        dataclasses.replace(all_settings()[name], name=f"my-{name}")
        for name in ("explicit", "contextual")
    ]
    register(*made)
    for setting in made:
        usual = instruct(HARD, setting.name.removeprefix("my-"), language=4)
        assert instruct(HARD, setting.name, language=4).turns == usual.turns


def test_a_setting_with_scenarios_reads_the_language():
    sentence = r"^The setting dummy has offers, so 'language' must be in its reads\.$"
    with pytest.raises(InvalidValueError, match=sentence):
        dataclasses.replace(DUMMY, offers="direct")


def recipe():
    """The file that docs/add-setting.md shows under "Add a setting"."""
    page = (Path(__file__).parents[2] / "docs" / "add-setting.md").read_text()
    section = page[page.index("## Add a setting") :]
    return re.search(r"```python\n(.*?)```", section, re.DOTALL)[1]


def test_the_recipe_of_the_docs_is_a_setting_of_an_installed_package(tmp_path, monkeypatch):
    (tmp_path / "my_setting.py").write_text(recipe())
    info = tmp_path / "my_package-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: my-package\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[roboirg.settings]\ninterrupted = my_setting:SETTING\n")
    monkeypatch.syspath_prepend(tmp_path)
    all_settings.cache_clear()
    try:
        assert setting_names()[-1] == "interrupted"
        for index in range(4):
            for task in ("PickXtimes", "BinFill"):
                assert not check_episode(get_episode(task, "test", index)).failures
        said = instruct_with(HARD, InstructionOptions("interrupted"))
        assert [one.stage for one in said.utterances] == ["introduction", "distractor", "command"]
        assert "interrupted" not in expressible(get_episode("VideoUnmask", "test", 0))
    finally:
        monkeypatch.undo()
        sys.modules.pop("my_setting", None)
        all_settings.cache_clear()
    assert "interrupted" not in setting_names()
