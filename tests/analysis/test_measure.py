"""Rates, gaps and corrected tests: against pandas and statsmodels, and by hand."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_records import make_record
from page_text import store

import roboirg
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.results.frame import make_frame
from roboirg.evaluation.analysis.results.option_labels import reference_of
from roboirg.evaluation.analysis.stats.cells import cells_of
from roboirg.evaluation.analysis.stats.intervals import wilson_interval
from roboirg.evaluation.analysis.stats.measure import ALL_TASKS, summarize
from roboirg.evaluation.plan.plan_maker import make_plan

Trials = dict[tuple[str, float], dict[float, bool]]


@pytest.fixture(scope="module")
def played(tmp_path_factory: pytest.TempPathFactory) -> pd.DataFrame:
    """Two policies and tasks, three episodes with two seeds in three settings."""
    folder = tmp_path_factory.mktemp("run")
    plan = make_plan(
        "listener,forgetful", tasks="PickXtimes,VideoUnmask",
        settings="explicit,direct,reasoning", episodes="3", policy_seeds="0,1",
    )  # fmt: skip
    store(folder, [make_record(job, "success") for job in plan.jobs()])
    return roboirg.results(folder)


def trials(rows: pd.DataFrame) -> Trials:
    """Return the verdicts of each task and episode by seed."""
    return {
        at: dict(zip(own["policy_seed"], own["outcome"] == "success", strict=True))
        for at, own in rows.groupby(["task", "episode"])
    }


def plain_gap(ours: Trials, theirs: Trials) -> float | None:
    """First less second on the seeds of an episode that both have, on all if they share none."""
    sides: dict[str, tuple[list[bool], list[bool]]] = {}
    for at in ours.keys() & theirs.keys():
        shared = ours[at].keys() & theirs[at].keys()
        for number, one in enumerate((ours[at], theirs[at])):
            own = sides.setdefault(at[0], ([], []))[number]
            own.extend(won for seed, won in one.items() if seed in shared or not shared)
    gaps = [np.mean(first) - np.mean(second) for first, second in sides.values()]
    return float(np.mean(gaps)) if gaps else None


@settings(max_examples=8)
@given(st.data())
def test_measure_is_what_pandas_gives(played: pd.DataFrame, data: st.DataObject) -> None:
    from statsmodels.stats.multitest import multipletests

    outcomes = st.sampled_from(["success", "failure", "error"])
    drawn = data.draw(st.lists(outcomes, min_size=len(played), max_size=len(played)))
    frame = played.assign(outcome=drawn)
    by = ("policy", "setting")
    found = roboirg.measure(frame, by, against={"setting": "explicit"}, family=["policy"])
    assert [one.key for one in found] == list(frame.groupby(list(by), sort=False).groups)
    judged = frame[frame["outcome"] != "error"].assign(won=lambda one: one["outcome"] == "success")
    rates = judged.groupby([*by, "task"])["won"].mean().groupby(list(by)).mean()
    for one in found:
        own, explicit = (
            judged[(judged["policy"] == one.key[0]) & (judged["setting"] == setting)]
            for setting in (one.key[1], "explicit")
        )
        assert (one.counts.trials, one.counts.successes) == (len(own), own["won"].sum())
        assert one.counts.errors == 3 * 2 * 2 - len(own)
        assert (
            one.rate is None if own.empty else float(one.rate or 0) == pytest.approx(rates[one.key])
        )
        gap = None if one.key[1] == "explicit" else plain_gap(trials(own), trials(explicit))
        assert (one.gap and one.gap.value) == (None if gap is None else pytest.approx(gap))
    for policy in ("listener", "forgetful"):
        tested = [one for one in found if one.gap and one.key[0] == policy]
        if tested:
            corrected = multipletests(
                [one.gap.p_value for one in tested if one.gap], method="holm"
            )[1]
            assert [one.p_holm for one in tested] == pytest.approx(list(corrected))


def test_rows_of_several_settings_are_pooled_in_any_order(played: pd.DataFrame) -> None:
    """By policy alone an episode has a row for each setting; none gets lost."""
    rates = played.groupby(["policy", "task"])["success"].mean().groupby("policy").mean()
    for frame in (played, played[::-1]):
        for one in roboirg.measure(frame, ["policy"], pool=["instruction_options"]):
            assert float(one.rate or 0) == pytest.approx(rates[one.key[0]])
            assert one.counts.trials == (played["policy"] == one.key[0]).sum()


def test_a_rate_is_over_both_forms_only_if_the_call_names_them(played: pd.DataFrame) -> None:
    """Implicit ones are won, resolved ones lost: 50 % is no success of either."""
    resolved = played.assign(form="resolved", outcome="failure", instruction_options="resolved")
    frame = pd.concat([played, resolved])
    with pytest.raises(
        InvalidValueError, match=r"values of form \(implicit, resolved\): add 'form'"
    ):
        roboirg.measure(frame, ["policy", "setting"])
    by_form = roboirg.measure(frame, ["policy", "setting", "form"])
    assert {(one.key[-1], one.rate) for one in by_form} == {("implicit", 1), ("resolved", 0)}
    both = roboirg.measure(frame, ["policy", "setting"], pool=["form", "instruction_options"])
    assert {(one.rate, one.counts.trials) for one in both} == {(Fraction(1, 2), 24)}


@pytest.mark.parametrize(
    ("asked", "words"),
    [
        ({"by": ["polcy"]}, "There is no column 'polcy'"),
        ({"by": ["policy"], "family": ["task"]}, "The column 'task' is not in by: policy."),
        ({"by": ["policy"], "against": {"setting": "direct"}}, "'setting' is not in by"),
        ({"by": ["setting"], "against": {"setting": "drect"}}, "no row with the setting 'drect'"),
        (
            {"by": ["setting"]},
            r"over several values of policy \(forgetful, listener\): add 'policy' to by",
        ),
        ({"by": ["policy", "setting"]}, "Several rows of a group are about"),
    ],
)
def test_a_wrong_question_is_one_sentence(played: pd.DataFrame, asked, words) -> None:
    with pytest.raises(InvalidValueError, match=words):
        roboirg.measure(pd.concat([played, played]), **asked)


@pytest.mark.parametrize("outcome", ["Success", "success ", True, 1, None])
def test_an_outcome_that_is_none_is_no_failure(played: pd.DataFrame, outcome: object) -> None:
    frame = played.astype({"outcome": object})
    frame.loc[0, "outcome"] = outcome
    with pytest.raises(InvalidValueError, match=f"'outcome' has (no value|{outcome!r};)"):
        roboirg.measure(frame, ["policy", "setting"])


@pytest.mark.parametrize("name", ["task", "episode", "policy_seed"])
def test_a_row_of_no_trial_is_refused(played: pd.DataFrame, name: str) -> None:
    with pytest.raises(InvalidValueError, match=f"{name!r} has no value in some row"):
        roboirg.measure(played.assign(**{name: pd.NA}), ["policy", "setting"])


def test_a_column_that_stands_twice_is_refused(played: pd.DataFrame) -> None:
    frame = pd.concat([played, played[["task"]]], axis=1)
    with pytest.raises(InvalidValueError, match="several columns 'task'"):
        roboirg.measure(frame, ["policy", "setting"])


def test_averages_are_unweighted_and_suites_stand_by_themselves(result) -> None:
    results = [
        *(result("success", episode, task="PickXtimes") for episode in range(9)),
        result("failure", 0, task="BinFill"),
        result("failure", 0, task="VideoUnmask"),
        result("success", 0, task="SomethingElse"),
    ]
    found = summarize(cells_of(make_frame([("run", results)])))
    rates = {key.scope: one.rate for key, one in found.items()}
    tasks = {"PickXtimes": 1, "BinFill": 0, "VideoUnmask": 0, "SomethingElse": 1}
    assert rates == {
        **tasks,
        "counting": Fraction(1, 2),
        "permanence": 0,
        ALL_TASKS: Fraction(1, 2),
    }
    assert list(rates)[-1] == ALL_TASKS


def test_gaps_are_paired_and_corrected_and_forms_compared(result) -> None:
    """All of 20 are won in explicit, none in direct, 15 in its resolved form, 19 in reasoning."""
    won = {
        reference_of(InstructionOptions()): 20,
        InstructionOptions("direct"): 0,
        InstructionOptions("direct", "resolved"): 15,
        InstructionOptions("reasoning"): 19,
    }
    results = [
        result("success" if episode < least else "failure", episode, options=options)
        for options, least in won.items()
        for episode in range(20)
    ]
    summaries = summarize(cells_of(make_frame([("run", results)])))
    found = {key.options: one for key, one in summaries.items() if key.scope == "PickXtimes"}
    explicit, direct, resolved, reasoning = (found[options] for options in won)
    assert (explicit.gap, explicit.p_holm, explicit.second_gap) == (None, None, None)
    assert explicit.interval == wilson_interval(20, 20)
    gaps = [one.gap.value for one in (direct, resolved, reasoning)]
    assert gaps == pytest.approx([-1, -0.25, -0.05])
    # Exact tests of 20, 5 and 1 episodes that differ, all to one side; Holm: by 3, 2 and 1.
    assert [one.p_holm for one in (direct, resolved, reasoning)] == pytest.approx(
        [3 * 2 / 2**20, 2 * 2 / 2**5, 1.0]
    )
    assert [
        one.p_holm for key, one in summaries.items() if key.options == InstructionOptions("direct")
    ] == pytest.approx([3 * 2 / 2**20] * 3), "tasks, suites and all of them are three families"
    assert direct.second_gap.value == -0.75
    assert direct.second_gap.overlap == (0, 0, 15, 5)
