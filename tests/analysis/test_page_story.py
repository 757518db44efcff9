"""A run of the listener and the forgetful policy, from records to page."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from roboirg.evaluation.analysis.stats.run_summary import ALL

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.figures import write_figures
from roboirg.evaluation.analysis.page.report import write_report
from roboirg.evaluation.analysis.stats.chance import CHANCE, floor_level
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.plan.plan_maker import make_plan
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.play.rollout import EpisodeRunner
from roboirg.evaluation.records.record import Record
from roboirg.evaluation.records.store import read_records
from roboirg.evaluation.run.executor import choose_executor
from roboirg.evaluation.run.runner import run_plan

pytestmark = [pytest.mark.sim, pytest.mark.slow]

PLAN = make_plan(
    ("listener", "forgetful"),
    tasks="SwingXtimes,ButtonUnmask,VideoRepick",
    forms="implicit,resolved",
    episodes="2",
)
"""A task of each suite, in all settings and forms."""
MOST_DEVIATIONS = 4
"""Standard deviations between what came of guessing and what is expected."""


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("story")
    summary = run_plan(PLAN, folder, EpisodeRunner(folder), choose_executor(None))
    assert not summary.errors
    assert not summary.missing
    return folder


def of(run: Path, policy: str) -> list[Record]:
    return [record for record in read_records(run) if record.policy == policy]


def test_the_listener_always_succeeds(run: Path) -> None:
    assert {record.outcome for record in of(run, "listener")} == {"success"}


def test_the_forgetful_policy_succeeds_where_nothing_has_to_be_remembered(run: Path) -> None:
    spelled = [
        record
        for record in of(run, "forgetful")
        if record.setting == "explicit" or record.form == "resolved"
    ]
    assert {record.outcome for record in spelled} == {"success"}


def test_elsewhere_it_guesses_and_every_miss_is_one_of_grounding(run: Path) -> None:
    guessed = [
        record
        for record in of(run, "forgetful")
        if record.setting != "explicit" and record.form == "implicit"
    ]
    chances = [float(floor_level(CHANCE, [record.identity])) for record in guessed]
    won = sum(record.outcome == "success" for record in guessed)
    deviation = math.sqrt(sum(chance * (1 - chance) for chance in chances))
    assert abs(won - sum(chances)) < MOST_DEVIATIONS * deviation
    assert 0 < won < len(guessed)
    kinds = {record.attribution and record.attribution.kind for record in guessed}
    assert kinds == {None, "grounding"}


def test_the_whole_report_follows(run: Path, tmp_path: Path) -> None:
    content = RunData.of([("story", read_records(run))], PLAN.jobs())
    listener, forgetful = content.names
    assert (listener.policy, forgetful.policy) == ("listener", "forgetful")
    direct = content.summaries[forgetful, ALL, InstructionOptions("direct")]
    assert direct.form_gap is not None
    assert direct.form_gap.value < -0.3
    assert direct.form_gap.overlap.only_first == direct.form_gap.overlap.neither == 0
    found = compare(
        *({key: one for key, one in content.cells.items() if key.policy_run == policy_run}
          for policy_run in (listener, forgetful)),
    )  # fmt: skip
    gaps = {result.key.options: result.gap.value for result in found.averages}
    resolved = InstructionOptions("direct", form="resolved")
    assert gaps[InstructionOptions("explicit")] == gaps[resolved] == 0
    assert gaps[InstructionOptions("direct")] > 0
    paths = write_figures(content, tmp_path)
    names = {path.stem.removesuffix("-dark") for path in paths}
    assert names == {"gaps", "forms", "failures"}
    assert "ended in an error (" not in write_report(Source(run)).read_text()
