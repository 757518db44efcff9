"""The headline number by hand, and what it takes to have one."""

import pytest
from flat_jobs import frame_of, make_result, make_results

from roboirg.analysis.measures import headline
from roboirg.analysis.measures.headline import headline_notes, measure_headline
from roboirg.analysis.measures.measured_floors import (
    RANDOM,
    TEST,
    FloorKey,
    measured_floors,
    settings_at_chance,
)
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.run_cells import cells_of
from roboirg.analysis.tables.paper_tables import make_table
from roboirg.analysis.tables.run_tables import make_run_tables
from roboirg.core.instruction_options import InstructionOptions
from roboirg.language import instruct
from roboirg.language.settings import all_settings, settings_of
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.shortcuts.shortcut_tables import Excess, ShortcutRow
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode

SETTINGS = ("reasoning", "spatial")


def random_policy_floors(excess):
    found = {}
    for name, value in excess.items():
        key = FloorKey(RANDOM, name)
        found[key] = ShortcutRow(key, 9, {}, Excess(value, 0.01))
    return found


@pytest.fixture
def floors_with_two_settings_near_chance(monkeypatch):
    """Floors of version 1 of the language, which made-up results have."""
    found = random_policy_floors({"direct": 0.7, "reasoning": 0.05, "spatial": -0.1})
    others = random_policy_floors({"direct": 0.7, "reasoning": 0.7, "spatial": -0.1})
    stored = {"1": found, LANGUAGE_VERSION: others}
    monkeypatch.setattr(headline, "measured_floors", stored.get)


def results_of_20_episodes_half_won():
    """As many episodes as an interval needs, the outcomes by turns."""
    wins = "01" * 10
    explicit = make_results("1" * 20)
    return [*explicit, *make_results(wins, "reasoning"), *make_results(wins, "spatial")]


def results_of_two_tasks(**fields):
    """Return results in two settings of PickXtimes and in one of StopCube.

    The gap of a setting is its rate minus that of explicit on the same episodes.
    """
    return [
        *make_results("1110", "explicit", **fields),
        *make_results("1100", "reasoning", **fields),  # 2 of 4: -1/4
        *make_results("00", "spatial", **fields),  # 0 of 2, explicit 2 of 2: -1
        *make_results("11", "explicit", task="StopCube", **fields),
        *make_results("01", "reasoning", task="StopCube", **fields),  # 1 of 2: -1/2
        *make_results("11", "direct", task="StopCube", **fields),
    ]


def results_of_one_episode():
    return [*make_results("1"), *make_results("0", "reasoning"), *make_results("0", "spatial")]


def headline_of(results, settings=SETTINGS):
    frame = frame_of(results)
    (policy_run,) = frame.names
    return measure_headline(cells_of(frame), policy_run, settings)


def notes_of(results):
    frame = frame_of(results)
    return list(headline_notes(cells_of(frame), frame.names))


def test_the_headline_number_is_the_mean_gap_of_the_settings_each_a_mean_over_its_tasks():
    """Gaps to explicit: reasoning -1/4 and -1/2 in two tasks, spatial -1 in one."""
    found = headline_of(results_of_two_tasks())
    assert found.gap == pytest.approx(((-1 / 4 - 1 / 2) / 2 + -1) / 2)
    assert (found.episodes, found.is_complete) == (6, True)
    low, high = found.interval
    assert -1 < low < found.gap < high

    lost = [*make_results("00"), *make_results("10", "reasoning"), *make_results("00", "spatial")]
    assert headline_of(lost).gap == 0.25  # though nothing was won without implicit reference


def test_the_headline_has_an_interval_although_all_episodes_ended_alike():
    """All are lost, and spatial has 5 of 20. A width of 0 would look like certainty."""
    lost = [
        *make_results("1" * 20),
        *make_results("0" * 20, "reasoning"),
        *make_results("0" * 5, "spatial"),
    ]
    found = headline_of(lost)
    assert found.gap == pytest.approx(-1)
    assert found.interval.high > -0.8


def test_a_second_setting_on_the_same_episodes_does_not_narrow_the_interval():
    """Half of explicit's wins are lost in each setting. Would find episodes drawn independently."""
    both, alone = (
        headline_of(results_of_20_episodes_half_won(), settings)
        for settings in (SETTINGS, SETTINGS[1:])
    )
    assert both.interval == pytest.approx(alone.interval)
    assert (both.gap, alone.gap) == pytest.approx((-0.5, -0.5))


def test_there_is_no_headline_without_explicit_or_without_one_of_its_settings():
    results = results_of_two_tasks()
    for setting in ("spatial", "explicit"):
        assert (
            headline_of([result for result in results if result.options.setting != setting]) is None
        )
    assert headline_of(results, ()) is None


def test_every_table_has_the_headline_below_it_or_the_reason_why_there_is_none(
    floors_with_two_settings_near_chance,
):
    (note,) = notes_of(results_of_20_episodes_half_won())
    assert note.startswith("Headline of listener: −50.0 points to explicit (95 % interval ")
    assert note.endswith("reasoning, spatial; 20 episodes.")
    assert notes_of(results_of_20_episodes_half_won()) == [note], "to explicit of the same language"

    frame = frame_of(results_of_20_episodes_half_won())
    (run_table,) = make_run_tables(frame)
    assert note in make_table("main", RunData(frame)).notes
    assert note in run_table.notes
    for setting in ("spatial", "explicit"):
        error = make_result("error", 20, options=InstructionOptions(setting))
        assert notes_of([*results_of_20_episodes_half_won(), error])[0].endswith(
            "20 episodes, incomplete."
        )
    for results, reason in (
        (results_of_one_episode(), "1 episode cannot give it an interval; play more."),
        (
            results_of_two_tasks(language_version="0.9"),
            "no floors were measured for its language",
        ),
        (
            results_of_two_tasks(wordings="robomme@1a2b3c4d"),
            "the floors are those of our own words of",
        ),
    ):
        (note,) = notes_of(results)
        assert note.startswith(f"listener has no headline number: {reason}")


def test_the_headline_counts_settings_in_which_shortcuts_win_at_most_5_points_over_chance():
    """Measured here: direct 5.01 points above, reasoning 5, spatial below.

    Parts (another pool of episodes, a single task) do not let direct in.
    """
    found = random_policy_floors({"direct": 0.0501, "reasoning": 0.05, "spatial": -0.3})
    parts = [FloorKey(TEST, "direct"), FloorKey(RANDOM, "direct", "StopCube")]

    found |= dict.fromkeys(parts, found[RANDOM, "spatial", "", ""])

    assert settings_at_chance(found) == ("reasoning", "spatial")


def test_rates_of_shortcuts_are_stored_for_every_implicit_setting_and_task():
    """If it fails after a change of words: `python scripts/measure_floors.py` measures them anew.

    Such a rate, a *floor*, is what a policy reaches without understanding.
    """
    implicit = {name for name, setting in all_settings().items() if setting.implicit}
    wanted = {FloorKey(RANDOM, name) for name in implicit}
    for task in all_tasks().values():
        wanted |= {FloorKey(RANDOM, name, task.name) for name in implicit & {*settings_of(task)}}

    language = instruct(get_episode("PickXtimes", "test", 0)).metadata["language_version"]
    measured = measured_floors(str(language)) or {}

    assert wanted <= measured.keys()
