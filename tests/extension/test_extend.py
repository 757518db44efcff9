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


@pytest.fixture
def without_a_simulator(monkeypatch):
    """Export synthetic trajectories instead of what the oracle does in the simulator."""
    monkeypatch.setattr(export_run, "record_trajectory", synthetic_trajectories.record)
    monkeypatch.setattr(export_run, "choose_policy", lambda job: None)


def test_the_model_provider_of_the_page_sends_the_question_with_its_key(monkeypatch):
    """A fixture has installed the code of docs/extend.md, as if it were a package: among it the
    model provider *lab*. As the page says, it takes its key from the variable LAB_KEY, sends it in
    the header X-Key, and writes each turn of a question as a role and a text."""
    monkeypatch.setenv("LAB_KEY", "secret")
    options = ModelOptions(provider="lab", model="lab-1")
    question = ModelQuery("you see", (ChatTurn("user", ("which?",)),))

    request = options.service.write(question, options, options.key())

    assert request.headers == {"X-Key": "secret"}
    assert json.loads(request.body)["turns"] == [{"role": "user", "text": "which?"}]


def test_the_model_provider_of_the_page_counts_costs_at_its_prices():
    """The provider *lab* of docs/extend.md declares 0.5 dollars per million tokens read and 2 per
    million written: 4 · 0.5 + 1 · 2 = 4 dollars."""
    options = ModelOptions(provider="lab", model="lab-1")
    reply = {"text": "red", "usage": {"read": 4_000_000, "written": 1_000_000}}

    assert options.cost_usd(options.service.read(reply)) == 4.0


def test_the_model_provider_of_the_page_has_no_prices_at_another_address():
    """The provider *lab* of docs/extend.md declares its prices for its own address; what another
    server with the same API costs is not known."""
    assert not ModelOptions(provider="lab", model="lab-1", base_url="http://here").has_prices


def test_the_export_format_of_the_page_writes_its_files_and_describes_them(
    folder_with_the_pages_code, without_a_simulator
):
    """A fixture has installed the code of docs/extend.md, as if it were a package: among it the
    format *lab-lines*. As the page says, it writes a file for each trajectory, with a line of JSON
    for each instruction: here one episode, instructed in two settings. Another fixture replaces the
    recording in the simulator by a synthetic trajectory."""
    printed_by(
        "export demonstrations --format lab-lines --tasks PickXtimes --episodes 1 "
        "--settings explicit,direct --workers 0 --out data"
    )

    data = folder_with_the_pages_code / "data"
    assert len((data / "000000.jsonl").read_text().splitlines()) == 2
    assert "Read the lines of" in (data / "README.md").read_text()


@pytest.fixture
def run(folder_with_the_pages_code):
    """A run of one episode with 3 calls and 7 steps by the checkpoint *mine*."""
    (job,) = make_plan("random", tasks="PickXtimes", settings="explicit", episodes="1").jobs()
    record = make_record(job, "failure", calls=3, steps=7, policy_metadata={"checkpoint": "mine"})
    return fill(folder_with_the_pages_code / "run", record)


def test_the_column_of_the_page_is_in_the_results(run):
    """The page's column *checkpoint* shows what a policy says in its metadata. The fixture's run
    has one episode, by the checkpoint *mine*."""
    assert list(roboirg.results(run)["checkpoint"]) == ["mine"]


def test_the_table_of_the_page_is_printed(run):
    """The page's table *calls* has how often a policy was called for actions. The fixture's run has
    one episode of the policy *random*, with 3 calls."""
    assert printed_by(f"tables {run} --which calls --format markdown").endswith("| random | 3 |\n")


def test_the_help_of_tables_names_the_table_of_the_page():
    """A fixture has installed the page's table *calls*, with the words *for actions*."""
    assert "calls (for actions)." in printed_by("tables --help")


def test_the_figure_of_the_page_is_drawn(run, folder_with_the_pages_code):
    """The page's figure is called *steps*; commands run in the folder of the fixture."""
    printed_by(f"figures {run} --which steps --out figures")
    assert (folder_with_the_pages_code / "figures/steps.svg").exists()
