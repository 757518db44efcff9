"""A run of made-up records is read in parts with the same results as in whole."""

import pytest
from benchmarks.synthetic_run import write_synthetic_run

from roboirg.analysis.page.report import write_report
from roboirg.analysis.results.frame import make_frame
from roboirg.analysis.results.run_cells import cells_of
from roboirg.analysis.results.sources import Source
from roboirg.records.store import read_records, read_results
from roboirg.runs.plan.stored_plans import read_plan

pytest.importorskip("jinja2")

COUNT = 100


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("large") / "run"
    write_synthetic_run(folder, COUNT)
    return folder


def test_parts_of_records_give_the_cells_of_whole_records(run):
    """A run of 100 made-up records; `read_results` reads only the parts of them that tables
    need."""
    plan = read_plan(run)
    assert plan is not None

    whole, parts = (
        cells_of(make_frame([("", records)], plan.jobs()))
        for records in (read_records(run), read_results(run))
    )
    assert repr(whole) == repr(parts)


def test_a_page_reads_one_record_after_the_other(run):
    """A run of 100 made-up records; progress is told after each of them, and the page has the turns
    of each."""
    told = []
    page = write_report(
        Source(run), progress=lambda done, total: told.append((done, total))
    ).read_text()

    assert page.count('"turns":') == COUNT
    assert told == [(done, COUNT) for done in range(1, COUNT + 1)]
