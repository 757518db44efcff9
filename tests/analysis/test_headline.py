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
from roboirg.language.settings import all_settings, settings_of
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.shortcuts.shortcut_shares import Excess, ShortcutRow
from roboirg.tasks import all_tasks

SETTINGS = ("reasoning", "spatial")
"""Settings of the headline in these tests; *explicit* is what they are compared with."""


def random_policy_floors(points_over_chance):
    """Return floors of the random episodes, as of ``{"direct": 0.7}``: 70 points over chance.

    A floor is what shortcuts reach without understanding the instruction.
    """
    found = {}
    for setting, excess in points_over_chance.items():
        key = FloorKey(RANDOM, setting)
        found[key] = ShortcutRow(key, 9, {}, Excess(excess, 0.01))
    return found


@pytest.fixture
def floors_with_two_settings_near_chance(monkeypatch):
    """Floors by which the headline has the settings reasoning and spatial, in language version 1.

    The current version has others, so that it shows if its floors are taken for version 1.
    """
    stored = {
        "1": random_policy_floors({"direct": 0.7, "reasoning": 0.05, "spatial": -0.1}),
        LANGUAGE_VERSION: random_policy_floors({"direct": 0.7, "reasoning": 0.7, "spatial": -0.1}),
    }
    monkeypatch.setattr(headline, "measured_floors", stored.get)


def results_of_20_episodes_half_won():
    """Return 20 explicit successes; in reasoning and spatial every second episode is lost."""
    half = "01" * 10
    return [
        *make_results("1" * 20, "explicit"),
        *make_results(half, "reasoning"),
        *make_results(half, "spatial"),
    ]


def headline_of(results, settings=SETTINGS):
    """Return the headline of the only policy; None if it has none."""
    frame = frame_of(results)
    (policy_run,) = frame.names
    return measure_headline(cells_of(frame), policy_run, settings)


def notes_of(results):
    """Return the notes that stand below tables, one for each policy."""
    frame = frame_of(results)
    return list(headline_notes(cells_of(frame), frame.names))


def test_the_headline_number_is_the_mean_gap_of_the_settings_each_a_mean_over_its_tasks():
    """A letter is an episode: 1 won, 0 lost. The setting direct does not count.

    Gaps to explicit on the same episodes: reasoning -1/4 and -1/2, a mean of -3/8; spatial -1.
    The mean of both is -11/16.
    """
    results = [
        *make_results("1110", "explicit", task="PickXtimes"),
        *make_results("1100", "reasoning", task="PickXtimes"),
        *make_results("00", "spatial", task="PickXtimes"),
        *make_results("11", "explicit", task="StopCube"),
        *make_results("01", "reasoning", task="StopCube"),
        *make_results("11", "direct", task="StopCube"),
    ]

    found = headline_of(results)

    assert found.gap == pytest.approx(-11 / 16)
    assert found.episodes == 6
    assert found.is_complete
    assert -1 < found.interval.low < -11 / 16 < found.interval.high


def test_the_headline_number_is_positive_if_implicit_instructions_are_won_more_often():
    """Of two episodes explicit wins none (0), reasoning one (1), and spatial none.

    The gaps to explicit are 1/2 and 0: a mean of 1/4.
    """
    results = [
        *make_results("00", "explicit"),
        *make_results("10", "reasoning"),
        *make_results("00", "spatial"),
    ]

    assert headline_of(results).gap == 0.25


def test_the_headline_has_an_interval_although_all_episodes_ended_alike():
    """Explicit wins all 20, the others none: the gap is -1.

    A width of 0 would look like certainty; with so few episodes the interval reaches up to -0.8 at
    least.
    """
    results = [
        *make_results("1" * 20, "explicit"),
        *make_results("0" * 20, "reasoning"),
        *make_results("0" * 5, "spatial"),
    ]

    found = headline_of(results)

    assert found.gap == pytest.approx(-1)
    assert found.interval.high > -0.8


def test_a_second_setting_on_the_same_episodes_does_not_narrow_the_interval():
    """In both settings 10 of the same 20 episodes are won, in explicit all.

    Would find settings that are counted as if their episodes were drawn independently.
    """
    results = results_of_20_episodes_half_won()

    both = headline_of(results, ("reasoning", "spatial"))
    alone = headline_of(results, ("spatial",))

    assert both.gap == alone.gap == pytest.approx(-0.5)
    assert both.interval == pytest.approx(alone.interval)


@pytest.mark.parametrize(
    ("played", "settings"),
    [
        (("reasoning", "spatial"), SETTINGS),
        (("explicit", "reasoning"), SETTINGS),
        (("explicit", "reasoning"), ()),
    ],
    ids=["no explicit results", "a setting was not played", "no setting counts"],
)
def test_there_is_no_headline_without_explicit_or_without_one_of_its_settings(played, settings):
    """`played` are the settings with two episodes each, `settings` those that count."""
    results = []
    for setting in played:
        results += make_results("11", setting)

    assert headline_of(results, settings) is None


@pytest.mark.usefixtures("floors_with_two_settings_near_chance")
def test_every_table_has_the_headline_below_it():
    """The headline number is the gap to explicit, as the mean over the settings that count for it.

    Explicit wins all 20 episodes, and each of the two settings every second one: −50 points. By
    the fixture these settings are reasoning and spatial. The paper's table and the run's have the
    same note.
    """
    frame = frame_of(results_of_20_episodes_half_won())
    (note,) = headline_notes(cells_of(frame), frame.names)

    main_table = make_table("main", RunData(frame))
    (run_table,) = make_run_tables(frame)

    assert note.startswith("Headline of listener: −50.0 points to explicit (95 % interval ")
    assert note.endswith("reasoning, spatial; 20 episodes.")
    assert note in main_table.notes
    assert note in run_table.notes


@pytest.mark.usefixtures("floors_with_two_settings_near_chance")
@pytest.mark.parametrize("setting", ["spatial", "explicit"])
def test_a_headline_is_called_incomplete_if_an_episode_behind_it_ended_in_an_error(setting):
    """Episodes 0 to 19 have verdicts in all settings; number 20 is an error in one of them."""
    error = make_result("error", episode=20, setting=setting)

    (note,) = notes_of([*results_of_20_episodes_half_won(), error])

    assert note.endswith("20 episodes, incomplete.")


@pytest.mark.usefixtures("floors_with_two_settings_near_chance")
@pytest.mark.parametrize(
    ("outcomes", "fields", "reason"),
    [
        ("1", {}, "1 episode cannot give it an interval; play more."),
        (
            "1111",
            {"language_version": "0.9"},
            "no floors were measured for its language",
        ),
        (
            "1111",
            {"wordings": "robomme@1a2b3c4d"},
            "the floors are those of our own words of",
        ),
    ],
    ids=["one episode", "a language without floors", "words of a file"],
)
def test_a_policy_without_a_headline_has_the_reason_below_its_table(outcomes, fields, reason):
    """In explicit and both settings that count, one or four episodes are played and won (1).

    Which settings count is known from *floors*: what is reached without understanding. By the
    fixture there are floors of version 1 of the language, which results have unless `fields` says
    otherwise, and of our own words, not those of a file.
    """
    results = []
    for setting in ("explicit", "reasoning", "spatial"):
        results += make_results(outcomes, setting, **fields)

    (note,) = notes_of(results)

    assert note.startswith(f"listener has no headline number: {reason}")


def test_the_headline_counts_settings_in_which_shortcuts_win_at_most_5_points_over_chance():
    """On random scenes, a learner that sees words alone guesses the goal more often than by chance.

    By 5.01 points in direct, which is too much, by 5 in reasoning, and in spatial less often.
    """
    floors = random_policy_floors({"direct": 0.0501, "reasoning": 0.05, "spatial": -0.3})

    assert settings_at_chance(floors) == ("reasoning", "spatial")


def test_a_part_of_a_setting_near_chance_does_not_let_the_setting_into_the_headline():
    """In direct as a whole, shortcuts win 70 points more than chance.

    On the test split alone, and in the task StopCube alone, they win 30 points less than chance.
    """
    floors = random_policy_floors({"direct": 0.7})
    (near_chance,) = random_policy_floors({"direct": -0.3}).values()
    floors[FloorKey(TEST, "direct")] = near_chance
    floors[FloorKey(RANDOM, "direct", "StopCube")] = near_chance

    assert settings_at_chance(floors) == ()


def test_rates_of_shortcuts_are_stored_for_every_implicit_setting_and_task():
    """Such a rate, a *floor*, is what is reached on random scenes without understanding the words.

    The package has a file of them for the current version of its language: for each setting, and
    for each task that has the setting. Explicit instructions need none. If it fails after a change
    of words, `python scripts/measure_floors.py` measures them anew.
    """
    wanted = set()
    for task in all_tasks().values():
        for setting in settings_of(task):
            wanted |= {FloorKey(RANDOM, setting), FloorKey(RANDOM, setting, task.name)}

    measured = measured_floors(LANGUAGE_VERSION)

    assert {key for key in wanted if all_settings()[key.setting].implicit} <= measured.keys()
