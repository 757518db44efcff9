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
from roboirg.language import instruct
from roboirg.language.settings import all_settings, settings_of
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.shortcuts.shortcut_tables import Excess, ShortcutRow
from roboirg.tasks import all_tasks
from roboirg.tasks.splits.splits import get_episode

SETTINGS = ("reasoning", "spatial")


def random_policy_floors(excess):
    """Return floors on random scenes, as of ``{"direct": 0.7}``.

    A value is how much more often than chance a learner that sees only the words is right: in a
    setting with 0.7 the words alone nearly give the goal away.
    """
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
    """Return as many episodes as an interval needs: explicit wins all, two settings every other."""
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


def headline_of(results, settings=SETTINGS):
    frame = frame_of(results)
    (policy_run,) = frame.names
    return measure_headline(cells_of(frame), policy_run, settings)


def notes_of(results):
    frame = frame_of(results)
    return list(headline_notes(cells_of(frame), frame.names))


def test_the_headline_number_is_the_mean_gap_of_the_settings_each_a_mean_over_its_tasks():
    """Gaps to explicit: reasoning -1/4 and -1/2 in two tasks, spatial -1 in one.

    Some resamples of so few episodes lack a setting, so that there is no interval.
    """
    found = headline_of(results_of_two_tasks())

    assert found.gap == pytest.approx(((-1 / 4 - 1 / 2) / 2 + -1) / 2)
    assert (found.episodes, found.is_complete) == (6, True)
    assert found.interval is None


def test_the_headline_is_positive_for_a_policy_that_wins_only_without_explicit_instructions():
    """Reasoning gains 1 of 2 and spatial nothing; would find a share of what explicit wins."""
    explicit = make_results("00", "explicit")
    reasoning = make_results("10", "reasoning")
    spatial = make_results("00", "spatial")

    assert headline_of([*explicit, *reasoning, *spatial]).gap == 0.25


def test_the_headline_has_no_interval_if_resamples_could_only_repeat_the_same_gap():
    """All episodes are lost, and spatial has 5 of 20: some resamples have none of these.

    The others all have a gap of -1, and an interval of width 0 would look like certainty.
    """
    explicit = make_results("1" * 20)
    reasoning = make_results("0" * 20, "reasoning")
    spatial = make_results("0" * 5, "spatial")

    found = headline_of([*explicit, *reasoning, *spatial])

    assert (found.gap, found.interval) == (-1, None)


def test_a_second_setting_on_the_same_episodes_does_not_narrow_the_interval():
    """Half of explicit's wins are lost in each setting. Would find episodes drawn independently."""
    results = results_of_20_episodes_half_won()

    both = headline_of(results, ("reasoning", "spatial"))
    alone = headline_of(results, ("spatial",))

    assert both.gap == alone.gap == -0.5
    assert both.interval == alone.interval


@pytest.mark.parametrize("lacking", ["spatial", "explicit"])
def test_there_is_no_headline_without_explicit_or_without_one_of_its_settings(lacking):
    results = [result for result in results_of_two_tasks() if result.setting != lacking]

    assert headline_of(results) is None


def test_there_is_no_headline_over_no_settings():
    assert headline_of(results_of_two_tasks(), ()) is None


def test_every_table_has_the_headline_below_it(floors_with_two_settings_near_chance):
    frame = frame_of(results_of_20_episodes_half_won())

    (note,) = headline_notes(cells_of(frame), frame.names)
    (run_table,) = make_run_tables(frame)
    paper_table = make_table("main", RunData(frame))

    assert note.startswith("Headline of listener: −50.0 points to explicit (95 % interval ")
    assert note.endswith("reasoning, spatial; 20 episodes.")
    assert note in run_table.notes
    assert note in paper_table.notes


@pytest.mark.parametrize("setting", ["spatial", "explicit"])
def test_a_headline_over_an_episode_without_a_verdict_is_called_incomplete(
    floors_with_two_settings_near_chance, setting
):
    error = make_result("error", 20, setting=setting)

    (note,) = notes_of([*results_of_20_episodes_half_won(), error])

    assert note.endswith("20 episodes, incomplete.")


@pytest.mark.parametrize(
    ("fields", "reason"),
    [
        ({}, "6 episodes cannot give it an interval; play more."),
        ({"language_version": "0.9"}, "no floors were measured for its language"),
        ({"wordings": "robomme@1a2b3c4d"}, "the floors are those of our own words of"),
    ],
)
def test_a_run_without_a_headline_gets_the_reason(
    floors_with_two_settings_near_chance, fields, reason
):
    """Too few episodes, or words of which nobody measured what they give away."""
    (note,) = notes_of(results_of_two_tasks(**fields))

    assert note.startswith(f"listener has no headline number: {reason}")


def test_the_headline_counts_settings_in_which_shortcuts_win_at_most_5_points_over_chance():
    """Measured here: direct 5.01 points above, reasoning 5, spatial below."""
    found = random_policy_floors({"direct": 0.0501, "reasoning": 0.05, "spatial": -0.3})

    assert settings_at_chance(found) == ("reasoning", "spatial")


def test_a_setting_at_chance_on_the_test_split_or_in_one_task_alone_is_not_in_the_headline():
    near_chance = random_policy_floors({"direct": -0.3})[RANDOM, "direct", "", ""]
    found = random_policy_floors({"direct": 0.0501, "spatial": -0.3})
    found[FloorKey(TEST, "direct")] = near_chance
    found[FloorKey(RANDOM, "direct", "StopCube")] = near_chance

    assert settings_at_chance(found) == ("spatial",)


def test_rates_of_shortcuts_are_stored_for_every_implicit_setting_and_task():
    """If it fails after a change of words: `python scripts/measure_floors.py` measures them anew.

    Such a rate, a *floor*, is what a policy reaches without understanding.
    """
    language = instruct(get_episode("PickXtimes", "test", 0)).metadata["language_version"]
    measured = measured_floors(str(language))
    assert measured is not None

    for name, setting in all_settings().items():
        if setting.implicit:
            assert FloorKey(RANDOM, name) in measured
            for task in all_tasks().values():
                if name in settings_of(task):
                    assert FloorKey(RANDOM, name, task.name) in measured
