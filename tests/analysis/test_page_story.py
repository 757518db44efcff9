"""A run of the listener and the forgetful policy, from records to page."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.page.report import write_report
from roboirg.evaluation.analysis.results.frame import make_frame
from roboirg.evaluation.analysis.stats.chance import CHANCE, floor_level
from roboirg.evaluation.analysis.stats.measure import ALL_TASKS
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
    episodes="1",
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


def needs_memory(record: Record) -> bool:
    return record.setting != "explicit" and record.form == "implicit"


def test_the_listener_succeeds_and_the_forgetful_one_where_nothing_has_to_be_remembered(
    run: Path,
) -> None:
    found = [one for one in read_records(run) if one.policy == "listener" or not needs_memory(one)]
    assert {record.outcome for record in found} == {"success"}


def test_elsewhere_it_guesses_and_every_miss_is_one_of_grounding(run: Path) -> None:
    found = [one for one in read_records(run) if one.policy == "forgetful"]
    guessed = list(filter(needs_memory, found))
    chances = [float(floor_level(CHANCE, [record.identity])) for record in guessed]
    won = sum(record.outcome == "success" for record in guessed)
    deviation = math.sqrt(sum(chance * (1 - chance) for chance in chances))
    assert abs(won - sum(chances)) < MOST_DEVIATIONS * deviation
    assert 0 < won < len(guessed)
    kinds = {record.attribution and record.attribution.kind for record in guessed}
    assert kinds == {None, "grounding"}


def test_numbers_and_page_follow(run: Path) -> None:
    content = RunData(make_frame([("story", read_records(run))], PLAN.jobs()))
    _, forgetful = content.frame.names
    direct = content.summaries[forgetful, ALL_TASKS, InstructionOptions("direct")]
    assert direct.second_gap is not None
    assert direct.second_gap.value < -0.3
    assert direct.second_gap.overlap.only_first == direct.second_gap.overlap.neither == 0
    assert "ended in an error (" not in write_report(Source(run)).read_text()
