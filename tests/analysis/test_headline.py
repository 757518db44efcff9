"""The headline number by hand, and what it takes to have one."""

from __future__ import annotations

import pytest
from roboirg.evaluation.analysis.stats.run_summary import ALL, summarize

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats import headline
from roboirg.evaluation.analysis.stats.cells import gather, labels
from roboirg.evaluation.analysis.stats.headline import headline_notes, measure_headline
from roboirg.evaluation.analysis.stats.measured_floors import (
    RANDOM,
    FloorKey,
    measured_floors,
    settings_at_chance,
)
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.run_tables import make_run_tables
from roboirg.language.settings import all_settings, settings_of
from roboirg.language.templates import LANGUAGE_VERSION
from roboirg.shortcuts.shortcut_tables import Excess, ShortcutRow
from roboirg.tasks import all_tasks

SETTINGS = ("reasoning", "spatial")
OUTCOMES = {True: "success", False: "failure"}


def floors(excess):
    return {
        key: ShortcutRow(key, 9, {}, Excess(value, 0.01))
        for key, value in ((FloorKey(RANDOM, name), value) for name, value in excess.items())
    }


@pytest.fixture
def two_settings(monkeypatch):
    """Floors of version 1 of the language, which made-up results have."""
    found = floors({"direct": 0.7, "reasoning": 0.05, "spatial": -0.1})
    stored = {"1": found, LANGUAGE_VERSION: found}
    monkeypatch.setattr(headline, "measured_floors", stored.get)


def played(result, task, setting, *won, wordings=None, **fields):
    options = InstructionOptions(setting, wordings=wordings)
    return [
        result(OUTCOMES[bool(one)], episode, task=task, options=options, **fields)
        for episode, one in enumerate(won)
    ]


def enough(result, **fields):
    """As many episodes as an interval needs, the outcomes by turns."""
    wins = [one % 2 for one in range(20)]
    tried = {"explicit": [1] * 20, "reasoning": wins, "spatial": wins}
    return [
        one
        for setting, won in tried.items()
        for one in played(result, "PickXtimes", setting, *won, **fields)
    ]


def by_hand(result, **fields):
    """PickXtimes has both settings, StopCube reasoning alone."""
    return [
        *played(result, "PickXtimes", "explicit", 1, 1, 1, 0, **fields),
        *played(result, "PickXtimes", "reasoning", 1, 1, 0, 0, **fields),  # 2 of 4: -1/4
        *played(result, "PickXtimes", "spatial", 0, 0, **fields),  # 0 of 2, explicit 2 of 2: -1
        *played(result, "StopCube", "explicit", 1, 1, **fields),
        *played(result, "StopCube", "reasoning", 0, 1, **fields),  # 1 of 2: -1/2
        *played(result, "StopCube", "direct", 1, 1, **fields),
    ]


def headlines_of(cells, settings=SETTINGS):
    return [measure_headline(cells, one, settings) for one in labels(cells)]


def test_the_mean_over_settings_of_the_means_over_their_tasks(result) -> None:
    (found,) = headlines_of(gather([("run", by_hand(result))]))
    assert found.gap == pytest.approx(((-1 / 4 - 1 / 2) / 2 + -1) / 2)
    assert found.episodes == 6
    assert found.is_complete
    assert found.interval.low <= found.gap <= found.interval.high


def test_of_one_setting_it_is_its_gap(result) -> None:
    cells = gather([("run", by_hand(result))])
    (found,) = headlines_of(cells, ("reasoning",))
    (row,) = (
        one for one in summarize(cells) if one.scope == ALL and one.options.setting == "reasoning"
    )
    assert found.gap == pytest.approx(row.gap.value)
    assert found.interval == pytest.approx(row.gap.interval, abs=0.1)


def test_settings_share_their_episodes(result) -> None:
    """Two settings with equal verdicts say no more than one: the interval is as wide."""
    results = played(result, "PickXtimes", "explicit", *[1] * 20)
    for setting in SETTINGS:
        results += played(result, "PickXtimes", setting, *([1, 0] * 10))
    cells = gather([("run", results)])
    (both,), (alone,) = headlines_of(cells), headlines_of(cells, ("spatial",))
    assert both.gap == alone.gap == -0.5
    assert both.interval == alone.interval


def test_it_needs_every_setting_and_explicit(result) -> None:
    results = by_hand(result)
    for setting in ("spatial", "explicit"):
        some = [one for one in results if one.options.setting != setting]
        assert headlines_of(gather([("run", some)])) == [None]
    assert headlines_of(gather([("run", results)]), ()) == [None]


def test_errors_make_it_incomplete(result, two_settings) -> None:
    results = [*enough(result), result("error", 20, options=InstructionOptions("spatial"))]
    cells = gather([("run", results)])
    (found,) = headlines_of(cells)
    assert not found.is_complete
    (note,) = headline_notes(cells, labels(cells))
    assert note.endswith("20 episodes, incomplete.")


def test_few_episodes_have_no_headline_number(result, two_settings) -> None:
    cells = gather([("run", by_hand(result))])
    assert list(headline_notes(cells, labels(cells))) == [
        "listener has no headline number: 6 episodes cannot give it an interval; play more."
    ]


def test_it_stands_next_to_every_table(result, two_settings) -> None:
    results = enough(result)
    cells = gather([("run", results)])
    (note,) = headline_notes(cells, labels(cells))
    assert note.startswith("Headline of listener: −50.0 points to explicit (95 % interval ")
    assert "reasoning, spatial; 20 episodes" in note
    assert note in make_table("main", cells).notes
    (table,) = make_run_tables(results).values()
    assert note in table.notes


def test_words_whose_floors_are_unknown_have_none(result, two_settings) -> None:
    cells = gather([("run", by_hand(result, language_version="0.9"))])
    (note,) = headline_notes(cells, labels(cells))
    assert note == (
        "listener has no headline number: no floors were measured for its language version 0.9."
    )
    cells = gather([("run", by_hand(result, wordings="robomme@1a2b3c4d"))])
    (note,) = headline_notes(cells, labels(cells))
    assert note.startswith("listener has no headline number: the floors are those of our own words")


def test_settings_count_up_to_five_points_above_chance() -> None:
    found = floors({"direct": 0.0501, "reasoning": 0.05, "spatial": -0.3})
    assert settings_at_chance(found) == ("reasoning", "spatial")


def test_floors_are_known_of_every_setting_and_task() -> None:
    """`python scripts/measure_floors.py` measures them anew, after a change of words."""
    found = measured_floors(LANGUAGE_VERSION)
    assert found is not None
    for name, setting in all_settings().items():
        if setting.implicit:
            assert FloorKey(RANDOM, name) in found
    for task in all_tasks().values():
        for name in settings_of(task):
            key = FloorKey(RANDOM, name, task.name)
            assert not all_settings()[name].implicit or key in found
