"""From a frame of trials to numbers, and from numbers to pages."""

import pandas as pd
import pytest
from experiment.measures import SHARE, Measure, measure_frame
from experiment.pages import read_numbers, with_numbers

import roboirg
from roboirg.core.errors import RoboIRGError

TASKS = {"PickXtimes": "counting", "VideoUnmask": "permanence"}


def trials(policy, setting, task, seed, ends):
    """Return rows of a frame: S is a success, G, E and U a failure of grounding, of execution, or
    one that is undecided, of the episodes 0, 1, 2, …"""
    kinds = {"G": "grounding", "E": "execution", "U": None, "S": None}
    rows = []
    for episode, end in enumerate(ends):
        row = {"policy": policy, "setting": setting, "instruction_options": setting, "task": task}
        row |= {"suite": TASKS[task], "policy_seed": seed, "episode": episode}
        outcome = "success" if end == "S" else "failure"
        rows.append({**row, "outcome": outcome, "failure_kind": kinds[end]})
    return rows


@pytest.fixture
def frame():
    """Two tasks of three episodes, each played with two seeds, of bodies with memory and without.

    With the true goal, and in explicit words, the body with memory always succeeds. In direct words
    its reader of explicit words fails in five of twelve trials; the body without memory in all.
    """
    rows = []
    for task in TASKS:
        for seed in (0, 1):
            for setting in ("explicit", "direct"):
                rows += trials("recurrent-truth", setting, task, seed, "SSS")
                rows += trials("none-explicit", setting, task, seed, "EEE")
            rows += trials("recurrent-explicit", "explicit", task, seed, "SSS")
    rows += trials("recurrent-explicit", "direct", "PickXtimes", 0, "SGG")
    rows += trials("recurrent-explicit", "direct", "PickXtimes", 1, "SSE")
    rows += trials("recurrent-explicit", "direct", "VideoUnmask", 0, "SSU")
    rows += trials("recurrent-explicit", "direct", "VideoUnmask", 1, "SSU")
    return pd.DataFrame(rows)


@pytest.mark.parametrize(
    ("scope", "number", "value", "by_seed"),
    [
        ("all tasks", "success", 7 / 12, "0.5 0.666667"),  # 3 of 6 and 4 of 6
        ("counting", "success", 3 / 6, "0.333333 0.666667"),
        ("all tasks", "grounding", 1 / 6, "0.333333 0.0"),  # 2 of 6 and 0 of 6
        ("all tasks", "execution", 1 / 12, "0.0 0.166667"),
        ("all tasks", "undecided", 1 / 6, "0.166667 0.166667"),
        ("all tasks", "success over explicit words", -5 / 12, "-0.5 -0.333333"),
        ("all tasks", "grounding over explicit words", 1 / 6, "0.333333 0.0"),
        ("permanence", "success over true goal", -1 / 3, "-0.333333 -0.333333"),
        ("all tasks", "success over no memory", 7 / 12, "0.5 0.666667"),
    ],
)
def test_a_number_is_the_mean_over_tasks_of_rates_or_of_paired_differences(
    scope, number, value, by_seed, frame
):
    """Of the body with memory, whose reader of explicit words hears direct ones."""
    measures = {measure[:5]: measure for measure in measure_frame(frame)}

    found = measures[scope, "recurrent", "explicit", "direct", number]

    assert found.value == pytest.approx(value, abs=1e-6)
    assert found.by_seed == by_seed
    assert found.low < found.value < found.high


def test_a_mean_over_implicit_settings_is_of_those_that_a_task_has():
    """The first task succeeds in two of four settings; the second one has no spatial instructions,
    and succeeds in two of three."""
    ends = {
        ("PickXtimes", "direct"): "SSS", ("PickXtimes", "reasoning"): "EEE",
        ("PickXtimes", "contextual"): "SSS", ("PickXtimes", "spatial"): "EEE",
        ("VideoUnmask", "direct"): "SSS", ("VideoUnmask", "reasoning"): "SSS",
        ("VideoUnmask", "contextual"): "EEE",
    }  # fmt: skip
    rows = []
    for (task, setting), of_episodes in ends.items():
        rows += trials("ttt-all", setting, task, 0, of_episodes)

    values = {measure[:5]: measure.value for measure in measure_frame(pd.DataFrame(rows))}

    mean = values["all tasks", "ttt", "all", "implicit", "success"]
    assert mean == pytest.approx((2 / 4 + 2 / 3) / 2, abs=1e-6)


def test_with_one_training_intervals_are_those_of_measure(frame):
    """`roboirg.measure` pairs the trials with other code; both give the gap to explicit words."""
    single = frame[frame["policy_seed"] == 0]
    recurrent = single[single["policy"] == "recurrent-explicit"]
    rows = roboirg.measure(
        recurrent, ["setting"], {"setting": "explicit"}, pool=["instruction_options"]
    )
    expected = {row.key: row for row in rows}["direct",]

    measures = {measure[:5]: measure for measure in measure_frame(single)}

    about = ("all tasks", "recurrent", "explicit", "direct")
    rate = measures[*about, "success"]
    gap = measures[*about, "success over explicit words"]
    assert (rate.low, rate.high) == pytest.approx(expected.interval, abs=1e-6)
    assert (gap.low, gap.high) == pytest.approx(expected.gap.interval, abs=1e-6)


def test_a_rewriter_closes_the_share_of_the_gap_that_it_gains():
    """The reader of explicit words loses ten of twenty successes in direct words, and five behind a
    rewriter."""
    rows = trials("ttt-explicit", "explicit", "PickXtimes", 0, 20 * "S")
    rows += trials("ttt-explicit", "direct", "PickXtimes", 0, 10 * "SG")
    rows += trials("ttt-resolve-surface", "direct", "PickXtimes", 0, 5 * "SGSS")

    measures = {measure[3:5]: measure for measure in measure_frame(pd.DataFrame(rows))}

    assert measures["direct", SHARE].value == pytest.approx(0.5)


def test_resolved_forms_are_settings_of_their_own(frame):
    """They count in no number of the setting."""
    direct = frame[frame["setting"] == "direct"]
    resolved = direct.assign(instruction_options="direct (resolved)")

    joined = pd.concat([frame, resolved])

    assert set(measure_frame(frame)) < set(measure_frame(joined))


def test_trials_that_two_parts_of_a_study_share_count_once(frame):
    """Both parts have played explicit words."""
    explicit = frame[frame["setting"] == "explicit"]

    assert measure_frame(pd.concat([frame, explicit])) == measure_frame(frame)


def test_a_policy_that_lacks_trials_is_refused(frame):
    """Its mean would be over other episodes than that of the others."""
    with pytest.raises(RoboIRGError, match="Trials are missing"):
        measure_frame(frame.iloc[1:])


def test_tables_and_slots_of_a_page_have_the_numbers_of_the_file(tmp_path):
    """A rate is in percent, a difference in points, in a table with its interval; what was written
    is replaced. The table is of what acts, and of the guess, which was not trained."""
    rate = ("all tasks", "recurrent", "all", "direct", "success")
    difference = (*rate[:4], "success over true goal")
    guess = ("all tasks", "*guess*", "–", "direct", "success")
    measures = [
        Measure(*guess, 0.425),
        Measure(*rate, 0.784, 0.74, 0.82, "0.77 0.798"),
        Measure(*rate[:2], "truth", *rate[3:], 0.8, 0.7, 0.9, "0.8"),
        Measure(*difference, -0.016, -0.05, 0.02, "0.0 -0.032"),
    ]
    pd.DataFrame(measures).to_csv(tmp_path / "numbers.csv", index=False)
    page = (
        "<!-- results -->\n\nold\n\n<!-- end of results -->\n\nIt reaches "
        f"<!-- {', '.join(rate)} -->50<!-- --> %, "
        f"<!-- {', '.join(difference)} --><!-- --> points.\n"
    )

    written = with_numbers(page, read_numbers(tmp_path / "numbers.csv"), {})

    assert written == (
        "<!-- results -->\n\n"
        "| memory | reader | direct |\n"
        "| --- | --- | ---: |\n"
        "| recurrent | all | 78<br>74–82 |\n"
        "| *guess* | – | 43 |\n\n"
        "<!-- end of results -->\n\nIt reaches <!-- all tasks, recurrent, all, direct, success -->"
        "78<!-- --> %, <!-- all tasks, recurrent, all, direct, success over true goal -->"
        "−2<!-- --> points.\n"
    )
