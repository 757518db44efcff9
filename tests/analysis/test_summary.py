"""Cells and the figures made of them."""

from __future__ import annotations

from fractions import Fraction

import numpy as np
import pytest
from roboirg.evaluation.analysis.stats.run_summary import ALL, Scope, summarize

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import CellResults, Trial, gather, labels
from roboirg.evaluation.analysis.stats.intervals import wilson_interval
from roboirg.evaluation.analysis.stats.option_labels import REFERENCE

DIRECT = InstructionOptions("direct")


def figures(results, planned=()):
    cells = gather([("run", results)], planned)
    found = summarize(cells)
    return {(one.policy_run.policy, one.scope, one.options): one for one in found}


def test_errors_and_what_is_missing_are_in_no_rate(result) -> None:
    results = [result("success", 0), result("failure", 1), result("error", 2)]
    planned = [result("success", episode).identity for episode in range(5)]
    ((key, cell),) = gather([("run", results)], planned).items()
    assert (key[1], key[2]) == ("PickXtimes", REFERENCE)
    assert cell == CellResults({Trial(0, 0): True, Trial(1, 0): False}, errors=1, missing=2)
    assert (cell.rate, cell.is_complete) == (Fraction(1, 2), False)


@pytest.mark.parametrize(
    ("changes", "label"),
    [
        ({"language_version": "2"}, "listener, language 2"),
        ({"environment_version": 2}, "listener, environment 2"),
        ({"policy_version": "b"}, "listener, policy b"),
        ({"max_steps": 100}, "listener, max steps 100"),
        ({"meshes": "light"}, "listener, meshes light"),
        ({"split": "val"}, "listener, split val"),
    ],
)
def test_what_is_not_alike_is_not_averaged(result, changes, label) -> None:
    cells = gather([("run", [result("success", 0), result("failure", 1, **changes)])])
    assert [float(cell.rate) for cell in cells.values()] == [1.0, 0.0]
    assert list(labels(cells).values())[1] == label


def test_policies_of_their_own_versions_are_called_by_their_names(result) -> None:
    cells = gather(
        [("run", [result(policy="a", policy_version="1"), result(policy="b", policy_version="2")])]
    )
    assert list(labels(cells).values()) == ["a", "b"]


def test_runs_complete_each_other_or_stand_apart(result) -> None:
    parts = gather([("a", [result("success", 0)]), ("b", [result("failure", 1)])])
    assert [cell.trials for cell in parts.values()] == [2]
    twice = gather([("a", [result("success", 0)]), ("b", [result("failure", 0)])])
    assert list(labels(twice).values()) == ["listener, a", "listener, b"]


def test_a_policy_that_has_not_begun_is_there(result) -> None:
    ((key, cell),) = gather([("run", [])], [result(policy="late").identity]).items()
    assert (key[0].policy, key[0].versions, cell.missing) == ("late", None, 1)


def test_averages_are_unweighted_and_suites_stand_by_themselves(result) -> None:
    results = [
        *(result("success", episode, task="PickXtimes") for episode in range(9)),
        result("failure", 0, task="BinFill"),
        result("failure", 0, task="VideoUnmask"),
        result("success", 0, task="SomethingElse"),
    ]
    found = figures(results)
    assert found["listener", Scope(suite="counting"), REFERENCE].rate == Fraction(1, 2)
    assert found["listener", Scope(suite="permanence"), REFERENCE].rate == 0
    everything = found["listener", ALL, REFERENCE]
    assert everything.rate == Fraction(1, 2)
    assert (everything.trials, everything.successes, len(everything.tasks)) == (12, 10, 4)
    assert [scope for _, scope, _ in found][-1] == ALL
    assert len(found) == 4 + 2 + 1


def test_gaps_are_paired_and_corrected_and_forms_compared(result) -> None:
    results = []
    for episode in range(20):
        results += [
            result("success", episode),
            result("failure", episode, setting="direct"),
            result(
                "success" if episode < 15 else "failure", episode, setting="direct", form="resolved"
            ),
            result("success" if episode else "failure", episode, setting="reasoning"),
        ]
    found = figures(results)
    cell = found["listener", Scope(task="PickXtimes"), DIRECT]
    assert cell.gap.value == -1
    assert cell.gap.p_value == pytest.approx(2 / 2**20)
    assert cell.p_holm == pytest.approx(3 * 2 / 2**20)
    assert cell.form_gap.value == -0.75
    assert cell.form_gap.overlap == (0, 0, 15, 5)
    reasoning = found["listener", Scope(task="PickXtimes"), InstructionOptions("reasoning")]
    assert (reasoning.gap.p_value, reasoning.p_holm) == (1.0, 1.0)
    assert reasoning.gap.retention == 0.95
    explicit = found["listener", Scope(task="PickXtimes"), REFERENCE]
    assert (explicit.gap, explicit.p_holm, explicit.form_gap) == (None, None, None)
    assert explicit.interval == wilson_interval(20, 20)


def test_the_same_results_in_any_order_give_the_same_figures(result) -> None:
    rng = np.random.default_rng(0)
    results = [
        result(
            "success" if rng.random() < 0.5 else "failure",
            episode,
            setting=setting,
            policy_seed=seed,
        )
        for setting in ("explicit", "direct")
        for episode in range(20)
        for seed in range(2)
    ]
    mixed = sorted(results, key=lambda one: (one.setting, one.policy_seed, -one.episode))
    mixed.sort(key=lambda one: one.setting != "explicit")
    assert list(figures(results).values()) == list(figures(mixed).values())
