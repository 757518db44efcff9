"""The documents are true: links lead somewhere, dependencies are explained, README's code runs."""

import csv
import itertools
import re
import tomllib
from collections import defaultdict
from pathlib import Path

import msgspec
import numpy as np
import pytest
from msgspec import inspect

import roboirg
from roboirg.analysis.measures.chance import floor_level
from roboirg.analysis.published import published_rows
from roboirg.core.actions import check_chunk
from roboirg.core.instruction_options import InstructionOptions
from roboirg.policies import Policy
from roboirg.records.record import Job, Record
from roboirg.tasks import find_tasks

ROOT = Path(__file__).parent.parent
PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
README = (ROOT / "README.md").read_text()
MOST_WORDS = 1800
SETTINGS = ("explicit", "direct", "reasoning", "contextual", "spatial")
"""The columns of the tables of results."""
GENERATED = "language-card.md"
"""A page that a program writes, which is not read from beginning to end."""


def python_blocks(text: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_to_a_file_leads_to_one(page):
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
        if "://" not in target:
            assert (page.parent / target).exists(), target


def test_the_page_about_records_lists_exactly_the_keys_of_a_record():
    table = (ROOT / "docs" / "record.md").read_text().split("## In Python")[0]
    keys = " ".join(line.split("|")[1] for line in table.splitlines() if line.startswith("| "))
    assert set(re.findall(r"`(\w+)`", keys)) == {*Record.__struct_fields__, "schema_version"}


def fields_of(kind: inspect.Type) -> list[str]:
    """Return the fields of the object that a type is, may be, or lists; empty if it is none."""
    for part in getattr(kind, "types", (kind,)):  # of a union, such as `Attribution | None`
        item = getattr(part, "item_type", part)  # of a tuple
        if hasattr(item, "fields"):
            return [field.encode_name for field in item.fields]
    return []


def test_the_page_about_records_lists_exactly_the_fields_of_objects_in_a_record():
    """They stand in braces: ``list of `{stage, text, step}```."""
    table = (ROOT / "docs" / "record.md").read_text().split("## In Python")[0]
    row = r"^\| \*?`(\w+)`\*? \| [^|]*\{([\w, ]+)\}"
    listed = dict(re.findall(row, table, flags=re.MULTILINE))

    in_record = {
        field.encode_name: fields_of(field.type) for field in inspect.type_info(Record).fields
    }

    assert listed == {key: ", ".join(names) for key, names in in_record.items() if names}


def test_every_dependency_is_explained_once_on_the_page_of_dependencies():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    extras = project["optional-dependencies"].values()
    learn = tomllib.loads((ROOT / "packages" / "learn" / "pyproject.toml").read_text())["project"]
    wanted = [*project["dependencies"], *itertools.chain(*extras), *learn["dependencies"]]
    names = {re.split(r"[\[<>=]", requirement)[0] for requirement in wanted}
    names -= {"roboirgbench", "roboirg-learn"}
    table = (ROOT / "docs" / "dependencies.md").read_text()

    explained = re.findall(r"^\| ([\w-]+) \| [`(]", table, flags=re.MULTILINE)

    assert sorted(explained) == sorted(names)


def test_the_version_is_the_same_in_all_files_that_name_it():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert project["version"] == roboirg.__version__
    assert f"## {roboirg.__version__}" in (ROOT / "CHANGELOG.md").read_text()
    assert f"\nversion: {roboirg.__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"version = {{{roboirg.__version__}}}" in README


def test_the_policy_in_readme_has_at_most_15_lines_and_answers_with_an_action():
    block = next(block for block in python_blocks(README) if "class MyPolicy" in block)
    body = [line for line in block.splitlines() if line.strip() and not line.startswith("#")]
    assert len(body) <= 15

    namespace: dict = {}
    exec(block, namespace)  # noqa: S102 - it is our own README
    policy = namespace["MyPolicy"]()
    assert isinstance(policy, Policy)

    policy.reset("Do it.", {"front_rgb": np.zeros((0, 256, 256, 3), np.uint8)})
    actions = policy.act({"joint_positions": np.zeros(7, np.float32)})
    assert check_chunk(actions).shape == (1, 8)


@pytest.mark.sim
def test_the_last_python_block_of_readme_runs(capsys):
    exec(python_blocks(README)[-1], {})  # noqa: S102 - it is our own README
    assert capsys.readouterr().out.strip().endswith(".")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_has_at_most_1800_words_of_prose(page):
    """Without code and what programs write into it."""
    prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    prose = re.sub(r"<!-- ([\w ]+) -->.*?<!-- end of \1 -->", "", prose, flags=re.DOTALL)  # made
    assert page.name == GENERATED or len(prose.split()) <= MOST_WORDS


def table_row_with(name: str, page: str = (ROOT / "docs" / "floors.md").read_text()) -> str:
    return next(line for line in page.splitlines() if name in line and line.startswith("|"))


def test_percentages_in_readme_are_those_of_the_published_table():
    best = [row for row in published_rows("main") if row.model == "FrameS-Modul"]
    rows = {row.options.setting: row for row in best}
    explicit = rows["explicit"].average
    spatial = rows["spatial"].average
    with_spatial = [task for task, rate in rows["spatial"].rates.items() if rate is not None]
    same_tasks = rows["explicit"].average_over(with_spatial)

    assert f"succeeds in {explicit:.0f} %" in README
    assert f"{rows['reasoning'].average:.0f} % is left with reasoning" in README
    assert f"covers 7 tasks: {spatial:.0f} %, next to {same_tasks:.0f} % explicit" in README
    # Lost are, as it says, a third in the direct setting and more than half in the others.
    assert 0.6 < rows["direct"].average / explicit < 0.7
    assert rows["reasoning"].average / explicit < 0.5
    assert rows["contextual"].average / explicit < 0.5
    assert spatial / same_tasks < 0.5


def test_results_published_since_the_paper_are_on_the_pages_as_in_their_file():
    """Means over the tasks of a CSV file, for each system."""
    rates = defaultdict(list)
    with (ROOT / "docs" / "robomme-since.csv").open(encoding="utf-8") as file:
        for line in csv.DictReader(file):
            rates[line["system"].split()[0]].append(float(line["success_percent"]))
    means = {system: np.mean(found) for system, found in rates.items()}

    page = (ROOT / "docs" / "comparability.md").read_text()

    assert f"| {means['GPT-6']:.1f} |" in table_row_with("GPT-6 Astra", page)
    assert f"| {means['agentic']:.1f} " in table_row_with("memory agent", page)
    assert f"reaches {means['GPT-6']:.0f} %" in README


def test_the_table_of_earlier_words_has_the_rates_of_its_csv_file():
    rows = defaultdict(list)
    with (ROOT / "results" / "earlier-words.csv").open(encoding="utf-8") as file:
        for line in csv.DictReader(file):
            row = (line["row"], line["learned from"], line["split"], line["seeds"])
            rows[row].append(f"{line['percent']} ({line['low']}–{line['high']})")

    lines = [f"| {' | '.join([*row, *rates])} |" for row, rates in rows.items()]

    assert "\n" + "\n".join(lines) + "\n\n" in (ROOT / "docs" / "earlier-words.md").read_text()


def test_the_success_of_guessing_is_the_same_number_on_all_pages():
    statistics = (ROOT / "docs" / "statistics.md").read_text()
    direct, reasoning, spatial = re.search(
        r"([\d.]+) in direct and contextual, ([\d.]+) in reasoning, ([\d.]+) in spatial", statistics
    ).groups()

    assert table_row_with("`forgetful` hears").endswith(
        f"100 | {direct} | {reasoning} | {direct} | {spatial} |"
    )
    assert f"{float(reasoning):.0f} to {float(spatial):.0f} % of the implicit" in README


@pytest.mark.parametrize(
    ("row", "floor", "setting"),
    [
        ("surface rule", "surface", "reasoning"),
        ("`forgetful` h", "command", "contextual"),
        ("chance: ", "chance", "direct"),
    ],
)
def test_rates_of_shortcuts_on_the_page_of_floors_are_those_that_the_program_computes(
    row, floor, setting
):
    """A mean over all tasks of 50 test episodes each, in percent."""
    options = InstructionOptions(setting)
    levels = []
    for task in find_tasks(["all"]):
        job = Job(policy="", task=task, split="test", episode=0, options=options)
        jobs = [msgspec.structs.replace(job, episode=number) for number in range(50)]
        levels.append(floor_level(floor, jobs))

    written = table_row_with(row).strip("| ").split(" | ")[1 + SETTINGS.index(setting)]

    assert float(written) == round(100 * float(sum(levels) / len(levels)), 1)


def test_the_six_tasks_named_as_without_video_are_those_of_the_table_of_tasks():
    page = (ROOT / "docs" / "own-checkpoint.md").read_text()
    listed = re.search(r"Six are left: ([\w,\s]+)\.", page)[1]

    rows = re.findall(
        r"^\|[^|]*\| (\w+) \|[^|]*\| no \|$", (ROOT / "docs" / "tasks.md").read_text(), re.M
    )

    assert set(re.findall(r"[A-Z]\w+", listed)) == set(rows) & {*find_tasks(["all"])}
