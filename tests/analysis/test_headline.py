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


def floors(excess):
    found = {}
    for name, value in excess.items():
        key = FloorKey(RANDOM, name)
        found[key] = ShortcutRow(key, 9, {}, Excess(value, 0.01))
    return found


@pytest.fixture
def two_settings(monkeypatch):
    """Floors of version 1 of the language, which made-up results have."""
    found = floors({"direct": 0.7, "reasoning": 0.05, "spatial": -0.1})
    others = floors({"direct": 0.7, "reasoning": 0.7, "spatial": -0.1})
    stored = {"1": found, LANGUAGE_VERSION: others}
    monkeypatch.setattr(headline, "measured_floors", stored.get)


def enough():
    """As many episodes as an interval needs, the outcomes by turns."""
    wins = "01" * 10
    explicit = make_results("1" * 20)
    return [*explicit, *make_results(wins, "reasoning"), *make_results(wins, "spatial")]


def by_hand(**fields):
    """PickXtimes has both settings, StopCube reasoning alone."""
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


def test_the_mean_over_settings_of_the_means_over_their_tasks():
    found = headline_of(by_hand())
    assert found.gap == pytest.approx(((-1 / 4 - 1 / 2) / 2 + -1) / 2)
    assert (found.episodes, found.is_complete) == (6, True)
    assert found.interval is None, "some resamples of so few episodes lack a setting"

    lost = [*make_results("00"), *make_results("10", "reasoning"), *make_results("00", "spatial")]
    assert headline_of(lost).gap == 0.25  # though nothing was won without implicit reference


def test_few_episodes_of_a_setting_that_are_all_lost_have_no_interval():
    """Some resamples have none of the five, all others have the same gap: its width would be 0."""
    lost = [
        *make_results("1" * 20),
        *make_results("0" * 20, "reasoning"),
        *make_results("0" * 5, "spatial"),
    ]
    assert (headline_of(lost).gap, headline_of(lost).interval) == (-1, None)


def test_settings_share_their_episodes():
    """Two settings with equal verdicts say no more than one: the interval is as wide."""
    both, alone = (headline_of(enough(), settings) for settings in (SETTINGS, SETTINGS[1:]))
    assert (both.gap, both.interval) == (alone.gap, alone.interval)
    assert both.gap == -0.5


def test_it_needs_every_setting_and_explicit():
    results = by_hand()
    for setting in ("spatial", "explicit"):
        assert (
            headline_of([result for result in results if result.options.setting != setting]) is None
        )
    assert headline_of(results, ()) is None


def test_it_stands_next_to_every_table_or_why_there_is_none(two_settings):
    (note,) = notes_of(enough())
    assert note.startswith("Headline of listener: −50.0 points to explicit (95 % interval ")
    assert note.endswith("reasoning, spatial; 20 episodes.")
    assert notes_of(enough()) == [note], "to explicit of the same language"

    frame = frame_of(enough())
    (run_table,) = make_run_tables(frame)
    assert note in make_table("main", RunData(frame)).notes
    assert note in run_table.notes
    for setting in ("spatial", "explicit"):
        error = make_result("error", 20, options=InstructionOptions(setting))
        assert notes_of([*enough(), error])[0].endswith("20 episodes, incomplete.")
    for results, reason in (
        (by_hand(), "6 episodes cannot give it an interval; play more."),
        (
            by_hand(language_version="0.9"),
            "no floors were measured for its language",
        ),
        (by_hand(wordings="robomme@1a2b3c4d"), "the floors are those of our own words of"),
    ):
        (note,) = notes_of(results)
        assert note.startswith(f"listener has no headline number: {reason}")


def test_settings_count_up_to_five_points_above_chance():
    found = floors({"direct": 0.0501, "reasoning": 0.05, "spatial": -0.3})
    parts = [FloorKey(TEST, "direct"), FloorKey(RANDOM, "direct", "StopCube")]

    found |= dict.fromkeys(parts, found[RANDOM, "spatial", "", ""])

    assert settings_at_chance(found) == ("reasoning", "spatial")


def test_floors_are_known_of_every_setting_and_task():
    """`python scripts/measure_floors.py` measures them anew, after a change of words."""
    implicit = {name for name, setting in all_settings().items() if setting.implicit}
    wanted = {FloorKey(RANDOM, name) for name in implicit}
    for task in all_tasks().values():
        wanted |= {FloorKey(RANDOM, name, task.name) for name in implicit & {*settings_of(task)}}

    language = instruct(get_episode("PickXtimes", "test", 0)).metadata["language_version"]
    measured = measured_floors(str(language)) or {}

    assert wanted <= measured.keys()
