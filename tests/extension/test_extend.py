"""What docs/extend.md adds, as it stands: a provider, a format, a column, a table and a figure."""

import json

import pytest
import synthetic_trajectories
from doc_recipe import install
from made_records import fill, make_record
from typer.testing import CliRunner

import roboirg
from roboirg.analysis.figures import figure_kinds
from roboirg.analysis.results.reading import record_columns
from roboirg.analysis.tables.diagnostic_tables import diagnostic_tables
from roboirg.apps.demonstrations import export_run
from roboirg.apps.demonstrations.export_format import export_formats
from roboirg.main import app
from roboirg.policies.vlm.model_content import ChatTurn
from roboirg.policies.vlm.models import ModelOptions, ModelQuery
from roboirg.policies.vlm.models.model import model_providers
from roboirg.runs.plan.plan_maker import make_plan

REGISTRIES = (model_providers, export_formats, record_columns, diagnostic_tables, figure_kinds)
QUESTION_TO_A_MODEL = ModelQuery("you see", (ChatTurn("user", ("which?",)),))
REPLY_OF_A_MODEL = {"text": "red", "usage": {"read": 4_000_000, "written": 1_000_000}}


def forget_what_was_registered():
    for registry in REGISTRIES:
        registry.cache_clear()


@pytest.fixture(autouse=True)
def folder_with_the_pages_code(tmp_path, monkeypatch):
    """Install what the page has; return the folder, from which commands run."""
    install(tmp_path, "extend")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.chdir(tmp_path)
    forget_what_was_registered()
    yield tmp_path
    forget_what_was_registered()


def printed_by(words):
    """Run a command; return what it prints."""
    done = CliRunner().invoke(app, words.split(), env={"COLUMNS": "300"})
    assert done.exit_code == 0, done.output
    return done.output


def test_the_model_provider_of_the_page_sends_its_key_and_counts_its_costs(monkeypatch):
    """REPLY_OF_A_MODEL has 4 million tokens read and 1 million written: 4 dollars at its prices.

    At another address prices are unknown.
    """
    monkeypatch.setenv("LAB_KEY", "secret")
    options = ModelOptions(provider="lab", model="lab-1")
    request = options.service.write(QUESTION_TO_A_MODEL, options, options.key())
    assert request.headers == {"X-Key": "secret"}
    assert json.loads(request.body)["turns"] == [{"role": "user", "text": "which?"}]
    assert options.cost_usd(options.service.read(REPLY_OF_A_MODEL)) == 4.0
    elsewhere = ModelOptions(provider="lab", model="lab-1", base_url="http://here")
    assert not elsewhere.has_prices


def test_the_export_format_of_the_page_writes_its_files_and_describes_them(
    folder_with_the_pages_code, monkeypatch
):
    monkeypatch.setattr(export_run, "record_trajectory", synthetic_trajectories.record)
    monkeypatch.setattr(export_run, "choose_policy", lambda job: None)
    words = "--format lab-lines --tasks PickXtimes --episodes 1 --workers 0 --out data"
    printed_by(f"export demonstrations --settings explicit,direct {words}")
    assert len((folder_with_the_pages_code / "data/000000.jsonl").read_text().splitlines()) == 2
    assert "Read the lines of" in (folder_with_the_pages_code / "data/README.md").read_text()


def test_the_column_table_and_figure_of_the_page_show_a_run(folder_with_the_pages_code):
    (job,) = make_plan("random", tasks="PickXtimes", settings="explicit", episodes="1").jobs()
    record = make_record(job, "failure", calls=3, steps=7, policy_metadata={"checkpoint": "mine"})
    run = fill(folder_with_the_pages_code / "run", record)
    assert list(roboirg.results(run)["checkpoint"]) == ["mine"]
    assert printed_by(f"tables {run} --which calls --format markdown").endswith("| random | 3 |\n")
    assert "calls (for actions)." in printed_by("tables --help")
    printed_by(f"figures {run} --which steps --out figures")
    assert (folder_with_the_pages_code / "figures/steps.svg").exists()
