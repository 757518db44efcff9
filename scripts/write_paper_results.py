"""Write the pages of the paper's experiment with small policies from the packs of its episodes.

python scripts/write_paper_results.py
"""

from __future__ import annotations

import functools
from collections.abc import Mapping
from pathlib import Path

from written_parts import rate_text, with_part

from roboirg import results
from roboirg.evaluation.analysis.published import published_rows
from roboirg.evaluation.analysis.results.frame import Frame, make_frame
from roboirg.evaluation.analysis.stats.cells import cells_of
from roboirg.evaluation.analysis.stats.measure import ALL_TASKS, Measured, ScopeKey, summarize
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.diagnostic_tables import make_failure_table
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.rendering.markdown import markdown
from roboirg.evaluation.plan.plan_file import read_plan_file
from roboirg.evaluation.records.packs import opened_run
from roboirg.evaluation.records.record import Summary
from roboirg.evaluation.records.store import read_results
from roboirg.language.settings import plain_settings
from roboirg_learn.policy.paper_experiment import CONTEXT, MAIN, PLANNER, SYSTEMS, row_name
from roboirg_learn.policy.paper_page import answers_text
from roboirg_learn.policy.policy_plan import PLANNERS

ROOT = Path(__file__).parent.parent
RATES, TABLES = ROOT / "docs" / "paper-results.md", ROOT / "docs" / "paper-tables.md"
PACKS = {
    part: path
    for part in (MAIN, CONTEXT, PLANNER)
    if (path := ROOT / "results" / f"paper-{part}-test.roboirg.zip").exists()
}
"""Of the parts that have been played."""


@functools.cache
def played() -> Mapping[str, Frame]:
    """Return the results of each part of the experiment; planners of the main part join theirs."""
    results: dict[str, list[Summary]] = {}
    for part, pack in PACKS.items():
        with opened_run(pack, ()) as run:
            results[part] = list(read_results(run))
    if PLANNER in results:
        tasks = read_plan_file("paper-planners")["tasks"]
        rows = {row_name(memory) for memory in PLANNERS}
        results[PLANNER] += [
            one
            for one in results[MAIN]
            if one.policy in rows and one.task in tasks and one.options.form == "implicit"
        ]
    return {part: make_frame([(part, found)]).told() for part, found in results.items()}


def rates_table(main: Frame) -> str:
    """Return success in each setting as mean over tasks, next to the published rates."""
    settings = plain_settings()
    lines = [f"| row | {' | '.join(settings)} |", "| --- " + "| ---: " * len(settings) + "|"]
    found = {
        (key.policy_run.policy, key.options.setting): one
        for key, one in summarize(cells_of(main)).items()
        if key.scope == ALL_TASKS and key.options.form == "implicit"
    }
    published = {(one.model, one.options.setting): one for one in published_rows("main")}
    for memory, system in SYSTEMS.items():
        own = [found.get((row_name(memory), name)) for name in settings]
        if any(own):
            lines += [f"| {row_name(memory)} | {' | '.join(map(_rate, own))} |"]
        theirs = [f"{published[system, name].average:.0f}" for name in settings]
        lines += [f"| {system} (published) | {' | '.join(theirs)} |"]
    return "\n".join(lines)


def _rate(row: Measured[ScopeKey] | None) -> str:
    if row is None or row.rate is None or row.interval is None:
        return "–"
    return rate_text(float(row.rate), row.interval)


def rates_page() -> str:
    """Return the page of results with the rates of the packs."""
    page = RATES.read_text(encoding="utf-8")
    return with_part(page, "paper rates", rates_table(played()[MAIN]))


def tables_page() -> str:
    """Return the page of answers and tables with those of the packs."""
    page = TABLES.read_text(encoding="utf-8")
    answers = answers_text({part: results(pack) for part, pack in PACKS.items()})
    page = with_part(page, "paper answers", answers)
    tables = [make_table(part, RunData(frame), published=True) for part, frame in played().items()]
    tables.append(make_failure_table(RunData(played()[MAIN]), means=True))
    texts = (markdown(table).rstrip() for table in tables)
    return with_part(page, "paper tables", "\n\n".join(texts))


if __name__ == "__main__":
    RATES.write_text(rates_page(), encoding="utf-8")
    TABLES.write_text(tables_page(), encoding="utf-8")
