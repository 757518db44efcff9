"""The documents are true: links lead somewhere, policies act, licenses and tools agree."""

import csv
import itertools
import json
import re
import subprocess
import tomllib
from collections import defaultdict
from pathlib import Path

import msgspec
import numpy as np
import pytest
from msgspec import inspect
from PIL import ExifTags, Image

import roboirg
from roboirg.analysis.measures.chance import floor_level
from roboirg.analysis.published import published_rows
from roboirg.core.actions import check_chunk
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.licenses import PICTURE_LICENSE
from roboirg.language import instruct
from roboirg.records.record import Job, Record
from roboirg.tasks import find_tasks
from roboirg.tasks.splits import get_episode

ROOT = Path(__file__).parent.parent


def text_of(name):
    """Return the text of a file of the repository."""
    return (ROOT / name).read_text(encoding="utf-8")


PAGES = sorted([*ROOT.glob("*.md"), *ROOT.glob("docs/*.md")])
README = text_of("README.md")
MOST_WORDS = {"README.md": 1100, "CHANGELOG.md": 1800}
"""Of the pages that may have more than `MOST_WORDS_OF_A_PAGE`."""
MOST_WORDS_OF_A_PAGE = 1200
SETTINGS = ("explicit", "direct", "reasoning", "contextual", "spatial")
"""The columns of the tables of results."""
GENERATED = (
    "attribution-rates.md",
    "language-card.md",
    "published-figures.md",
    "scenario-marks.md",
)
"""Pages that programs write, which are not read from beginning to end."""


def python_blocks(text: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", text, flags=re.DOTALL)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_link_to_a_file_leads_to_one(page):
    for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text()):
        if "://" not in target:
            assert (page.parent / target).exists(), target


@pytest.mark.parametrize("name", ["scene.png", "film.webp"])
def test_a_picture_of_readme_shows_the_words_that_are_said_today(name):
    """`scripts/readme-pictures` stores in a picture's file what it wrote into the picture."""
    with Image.open(ROOT / "docs/images" / name) as picture:
        drawn = json.loads(picture.getexif()[ExifTags.Base.ImageDescription])

    episode = get_episode(drawn["task"], "test", drawn["episode"])
    for setting, words in drawn["said"].items():
        assert words == instruct(episode, setting).text


def test_the_page_about_records_lists_exactly_the_keys_of_a_record():
    table = text_of("docs/record.md").split("## In Python")[0]
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
    """Where a key of a record holds an object, or a list of some, its row on the page has the names
    in braces, such as "| `instruction` | list of `{stage, text, step}` |". They must be those of
    the class that `Record` declares for the key, in the same order."""
    table = text_of("docs/record.md").split("## In Python")[0]
    key_then_names_in_braces = r"^\| \*?`(\w+)`\*? \| [^|]*\{([\w, ]+)\}"
    on_page = dict(re.findall(key_then_names_in_braces, table, flags=re.MULTILINE))

    declared = {}
    for field in inspect.type_info(Record).fields:
        if names := fields_of(field.type):
            declared[field.encode_name] = ", ".join(names)

    assert declared["instruction"] == "stage, text, step"
    assert on_page == declared


def project_of(pyproject):
    """Return what a pyproject.toml says of its package."""
    return tomllib.loads(text_of(pyproject))["project"]


def required_by(pyproject):
    """Return the names of the packages that a pyproject.toml requires, also in its extras."""
    project = project_of(pyproject)
    extras = project.get("optional-dependencies", {}).values()
    requirements = itertools.chain(project["dependencies"], *extras)
    return {re.split(r"[\[<>=]", requirement)[0] for requirement in requirements}


def test_every_dependency_is_explained_once_on_the_page_of_dependencies():
    """A row of the page's table begins with the name of a package; behind it the reason stands in
    backquotes or brackets. There must be one for each package that the benchmark or roboirg-learn
    requires, in any extra, but for these two themselves."""
    required = required_by("pyproject.toml")
    required |= required_by("packages/learn/pyproject.toml")
    page = text_of("docs/decisions.md")

    explained = re.findall(r"^\| ([\w-]+) \| [`(]", page, flags=re.MULTILINE)

    assert sorted(explained) == sorted(required - {"roboirgbench", "roboirg-learn"})


def test_the_version_is_the_same_in_all_files_that_name_it():
    """The package's own is compared with those of the three distributions, the change log, the file
    for citations, and the BibTeX entry in README."""
    for folder in (".", "packages/learn", "integrations/lerobot_env_roboirg"):
        assert project_of(f"{folder}/pyproject.toml")["version"] == roboirg.__version__
    assert f"## {roboirg.__version__}" in text_of("CHANGELOG.md")
    assert f"\nversion: {roboirg.__version__}\n" in text_of("CITATION.cff")
    assert f"version = {{{roboirg.__version__}}}" in README


@pytest.mark.parametrize("page", ["docs/licenses.md", "NOTICE", "mkdocs.yml"])
def test_page_notice_and_footer_of_the_site_name_the_license_of_exported_pictures(page):
    """As its owner writes it, "CC BY-NC 4.0"; in exports it is `cc-by-nc-4.0`."""
    assert PICTURE_LICENSE in text_of(page).lower().replace(" ", "-")


def test_every_action_of_the_workflows_is_pinned_by_a_commit_and_names_its_version():
    """A tag can be moved to other code."""
    workflows = text_of(".github/workflows/ci.yml") + text_of(".github/workflows/release.yml")
    for action in re.findall("uses: (.+)", workflows):
        assert re.fullmatch(r"[\w./-]+@[0-9a-f]{40} # v\d+\.\d+\.\d+", action)


def test_the_hooks_of_commits_run_what_make_lint_runs():
    """Make prints what it would run; the environment and cffconvert count as made already."""
    command = "make -n --no-print-directory -o dev -o build/citation/bin/cffconvert lint"

    wanted = subprocess.check_output(command.split(), cwd=ROOT, text=True)

    hooks = re.findall("entry: (.+)", text_of(".pre-commit-config.yaml"))
    assert hooks == wanted.splitlines()


def policy_on(page, name, most_lines):
    """Return the policy class that a code block of a page defines; the block must be short."""
    block = next(block for block in python_blocks(text_of(page)) if f"class {name}" in block)
    assert block.count("\n") <= most_lines
    namespace = {"__name__": "page"}
    exec(block, namespace)  # noqa: S102 - it is our own page
    return namespace[name]


def test_the_policy_in_readme_has_at_most_15_lines_and_answers_with_an_action():
    """It must answer an observation with one action of eight numbers."""
    policy = policy_on("README.md", "MyPolicy", 15)()

    policy.reset("Do it.", {"front_rgb": np.zeros((0, 256, 256, 3))})
    actions = policy.act({"joint_positions": np.zeros(7, np.float32)})

    assert check_chunk(actions).shape == (1, 8)


@pytest.mark.sim
def test_the_policy_that_sees_has_at_most_70_lines_and_succeeds_in_the_simulator(tmp_path):
    """In val episode 10 it must place the green one of three cubes twice, in 30 the blue one once.
    Would find a change of depth, camera matrices or waypoints that breaks policies of users."""
    results = roboirg.evaluate(
        policy_on("docs/seeing-policy.md", "SeeingPolicy", 70),
        tasks="PickXtimes", settings="explicit", split="val", episodes=[10, 30],
        out=tmp_path, workers=0,
    )  # fmt: skip

    assert results.rates() == {("SeeingPolicy", "explicit"): 1.0}


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_has_at_most_1200_words_of_prose(page):
    """Without code, the lines of tables, and what programs write into it."""
    prose = re.sub(r"^ *```.*?^ *```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
    prose = re.sub(r"<!-- ([\w ]+) -->.*?<!-- end of \1 -->", "", prose, flags=re.DOTALL)  # made
    words = prose.replace("|", " ").split()
    most = MOST_WORDS.get(page.name, MOST_WORDS_OF_A_PAGE)
    assert page.name in GENERATED or len(words) <= most


def table_row_with(name, page):
    """Return the first row of a table of a page that has a text."""
    lines = text_of(f"docs/{page}.md").splitlines()
    return next(line for line in lines if name in line and line.startswith("|"))


@pytest.fixture
def best_published():
    """The rates of RoboMME's best published model, FrameS-Modul, in percent, by setting."""
    rows = [row for row in published_rows("main") if row.model == "FrameS-Modul"]
    return {row.options.setting: row for row in rows}


def tasks_with_rates(row):
    """Return the tasks for which a published row has a rate: of spatial instructions, seven."""
    return [task for task, rate in row.rates.items() if rate is not None]


def test_percentages_in_readme_are_those_of_the_published_table(best_published):
    """README quotes means over tasks of the best published model."""
    assert f"succeeds in {best_published['explicit'].average:.0f} %" in README
    assert f"{best_published['reasoning'].average:.0f} % in reasoning" in README


def test_readme_rightly_says_that_a_third_is_lost_with_direct_and_over_half_with_others(
    best_published,
):
    """README says so in words, of the best published model. What is left, as a share of the rate
    with explicit instructions: of direct ones about two thirds, of the others less than half.
    Spatial ones exist for seven tasks alone, and are compared with explicit ones for these."""
    explicit = best_published["explicit"].average
    seven_tasks = tasks_with_rates(best_published["spatial"])
    explicit_of_seven = best_published["explicit"].average_over(seven_tasks)

    assert 0.6 < best_published["direct"].average / explicit < 0.7
    assert best_published["reasoning"].average / explicit < 0.5
    assert best_published["contextual"].average / explicit < 0.5
    assert best_published["spatial"].average / explicit_of_seven < 0.5


def test_results_published_since_the_paper_are_on_the_pages_as_in_their_file():
    """The file has a row for each system and task, with the success in percent. A system's mean
    over its tasks stands in its row on the page about comparability."""
    rates = defaultdict(list)
    for row in csv.DictReader(text_of("docs/robomme-since.csv").splitlines()):
        rates[row["system"]].append(float(row["success_percent"]))
    planner = np.mean(rates["GPT-6 Astra planner + Qwen3-VL monitor + pi0.5 hands"])
    memory = np.mean(rates["agentic memory + Qwen3-VL-4B planner + GroundSG hands"])

    assert f"| {planner:.1f} |" in table_row_with("GPT-6 Astra", "comparability")
    assert f"| {memory:.1f} " in table_row_with("memory agent", "comparability")


def test_the_table_of_earlier_words_has_the_rates_of_its_csv_file():
    """The file has a row for each policy and setting. The table has one for each policy, such as
    "| small-none | explicit | test | 1 | 24 (20–27) | 22 (18–25) |": what it learned from, the
    split, the number of seeds, and for each setting the rate with its interval, in percent."""
    rates_of_policies = defaultdict(list)
    for row in csv.DictReader(text_of("results/earlier-words.csv").splitlines()):
        policy = f"{row['row']} | {row['learned from']} | {row['split']} | {row['seeds']}"
        rates_of_policies[policy].append(f"{row['percent']} ({row['low']}–{row['high']})")

    lines = [f"| {policy} | {' | '.join(rates)} |" for policy, rates in rates_of_policies.items()]

    assert lines
    assert "\n".join(["", *lines, "", ""]) in text_of("docs/earlier-words.md")


def test_the_success_of_guessing_is_the_same_number_on_all_pages():
    """The page about statistics has the percentages in a sentence, by setting; the page about
    floors has them in the row of `forgetful`, which guesses, README in that of the guess."""
    statistics = text_of("docs/statistics.md")
    direct, reasoning, spatial = re.search(
        r"([\d.]+) in direct and contextual, ([\d.]+) in reasoning, ([\d.]+) in spatial", statistics
    ).groups()

    assert table_row_with("`forgetful` hears", "controls").endswith(
        f"100 | {direct} | {reasoning} | {direct} | {spatial} |"
    )
    guess = next(line for line in README.splitlines() if line.startswith("| *guess* |"))
    assert guess.endswith(f"| 100 | {direct} | {reasoning} | {direct} | {spatial} |")


def percent_on_the_page_of_floors(row, setting):
    """Return the number in the row of the table that has a text, in the column of a setting."""
    _, *percentages = table_row_with(row, "controls").strip("| ").split(" | ")
    return float(percentages[SETTINGS.index(setting)])


def computed_percent(floor, setting):
    """Return the success of a shortcut, a mean over all tasks of 50 test episodes each, percent."""
    levels = []
    for task in find_tasks(["all"]):
        job = Job(
            policy="", task=task, split="test", episode=0, options=InstructionOptions(setting)
        )
        jobs = [msgspec.structs.replace(job, episode=number) for number in range(50)]
        levels.append(floor_level(floor, jobs))
    return 100 * float(sum(levels) / len(levels))


@pytest.mark.parametrize(
    ("row", "floor", "setting"),
    [
        ("surface rule: key words", "surface", "reasoning"),
        ("`forgetful` hears the last utterance", "command", "contextual"),
        ("chance: a guess", "chance", "direct"),
    ],
)
def test_rates_of_shortcuts_on_the_page_of_floors_are_those_that_the_program_computes(
    row, floor, setting
):
    """A floor is what a shortcut reaches without understanding: key words, a guess from the command
    alone, or one from the command and what the words list. The page has a row for each and a
    column for each setting, in percent with one decimal."""
    on_page = percent_on_the_page_of_floors(row, setting)

    assert on_page == round(computed_percent(floor, setting), 1)


def test_the_six_tasks_named_as_without_video_are_those_of_the_table_of_tasks():
    """The page about own checkpoints lists them in a sentence. In the table of tasks their last
    column, whether there is a video, is "no"; tasks that are not of RoboMME's are left out."""
    page = text_of("docs/own-checkpoint.md")
    listed = re.search(r"Six are left: ([\w,\s]+)\.", page)[1]

    rows = re.findall(r"^\|[^|]*\| (\w+) \|[^|]*\| no \|$", text_of("docs/tasks.md"), re.M)

    assert set(re.findall(r"[A-Z]\w+", listed)) == set(rows) & {*find_tasks(["all"])}
