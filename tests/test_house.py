"""Structure and names of the package, read from its source."""

import ast
import gc
import itertools
import re
import subprocess
import tomllib
from collections import defaultdict
from typing import NamedTuple

import layout
import pytest
from house_rooms import PACKAGE, PACKAGES, ROOT, SOURCES, TESTS, house_files

ALL_SOURCE_FILES = [
    *SOURCES,
    *(path for package in PACKAGES for path in package.rglob("*.py") if path not in TESTS),
]
"""The benchmark's files and those of the packages next to it."""

MOST_ROOMS = 21
MOST_ARROWS = 101

MAY_IMPORT = {"reader": {"core", "tasks"}, "records": {"core", "util"}, "stats": {"core"}}
"""The reader is evidence; records are read without tasks or words; statistics need numbers."""

CEILINGS = tomllib.loads((ROOT / "tests" / "ceilings.toml").read_text("utf-8"))
DEFINITIONS = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
"""What can have a docstring."""


class Size(NamedTuple):
    nodes: int
    statements: int


@pytest.fixture(autouse=True, scope="module")
def collector_at_rest():
    """Syntax trees are many objects, and the collector would walk through them again and again."""
    gc.disable()
    yield
    gc.enable()


def check_empty(found):
    """Fail with a line for each entry."""
    if found := sorted(map(str, found)):
        pytest.fail("\n".join(found), pytrace=False)


def is_docstring(statement):
    """Return whether a statement of a body is nothing but a text."""
    is_constant = isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    return is_constant and isinstance(statement.value.value, str)


def free_nodes(tree):
    """Return the nodes of docstrings and imports, which need not be thinned to save any."""
    free = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            free.update(ast.walk(node))
        if isinstance(node, DEFINITIONS):
            for statement in filter(is_docstring, node.body):
                free.update(ast.walk(statement))
    return free


def size_of(paths):
    """Return the nodes of the syntax trees of some files, and how many of them are statements."""
    size = Size(0, 0)
    for path in paths:  # parsed anew: trees of all tests would fill the memory
        tree = ast.parse(path.read_text("utf-8"))
        free = free_nodes(tree)
        counted = [node for node in ast.walk(tree) if node not in free]
        statements = sum(isinstance(node, ast.stmt) for node in counted)
        size = Size(size.nodes + len(counted), size.statements + statements)
    return size


def lines_of(suffixes):
    """Return the lines of files with these endings, without tests and what describes packages."""
    folders = (PACKAGE, ROOT / "packages", ROOT / "integrations")
    paths = [path for folder in folders for path in folder.rglob("*") if path.suffix in suffixes]
    counted = [
        path for path in paths if "tests" not in path.parts and path.name != "pyproject.toml"
    ]
    return sum(path.read_text("utf-8").count("\n") for path in counted)


@pytest.fixture(scope="module")
def sizes():
    """The size of each folder of the code, by its name."""
    return {folder: size_of(paths) for folder, paths in house_files().items()}


def test_ceilings_of_folders_add_up_to_that_of_the_whole():
    """The file ceilings.toml says how large each folder of the code may be and, as `nodes`, all of
    it: a folder can be given more only if another one gets less."""
    assert sum(CEILINGS["rooms"].values()) == CEILINGS["nodes"]


def test_no_folder_of_the_code_is_larger_than_its_ceiling(sizes):
    """Size is the number of nodes of the syntax trees, without docstrings and imports. The file
    ceilings.toml has the most for each folder under `rooms`; one that it lacks may have none."""
    ceilings = CEILINGS["rooms"]

    found = []
    for folder, size in sizes.items():
        if size.nodes > ceilings.get(folder, 0):
            found.append(f"{folder} has {size.nodes} of {ceilings.get(folder)}: let things go")

    check_empty(found)


def test_statements_of_the_code_have_few_nodes_on_average(sizes):
    """The mean number of nodes of the syntax tree in a statement says how dense the code is; the
    file ceilings.toml has the most."""
    nodes = sum(size.nodes for size in sizes.values())
    statements = sum(size.statements for size in sizes.values())

    assert nodes / statements <= CEILINGS["nodes_a_statement"]


SCRIPTS = sorted((ROOT / "scripts").rglob("*.py"))
PAGE_CODE = (".js", ".css", ".j2", ".html")
DATA = (".toml", ".yaml", ".yml")


@pytest.mark.parametrize(
    ("ceiling", "files"), [("nodes_of_tests", TESTS), ("nodes_of_scripts", SCRIPTS)]
)
def test_tests_and_scripts_stay_below_their_ceilings(ceiling, files):
    """Counted are nodes of the syntax trees, without docstrings and imports; the file ceilings.toml
    has the most."""
    assert size_of(files).nodes <= CEILINGS[ceiling]


@pytest.mark.parametrize(
    ("ceiling", "endings"), [("lines_of_page_code", PAGE_CODE), ("lines_of_data", DATA)]
)
def test_page_code_and_data_stay_below_their_ceilings(ceiling, endings):
    """Counted are lines of files with such an ending; the file ceilings.toml has the most."""
    assert lines_of(endings) <= CEILINGS[ceiling]


def unexplained_rises(before, after):
    """Return a line for each ceiling that rose by more than what the growths added with it give."""
    known = before.get("growth", [])
    new = [growth for growth in after.get("growth", []) if growth not in known]
    found = []
    for name in before.keys() & after.keys() - {"rooms", "growth"}:
        most = before[name] + sum(growth.get(name, 0) for growth in new)
        if after[name] > most:
            found.append(f"{name} rose from {before[name]} to {after[name]}; it may have {most}")
    return found


def git(*words):
    """Return what Git prints; nothing outside of a checkout."""
    done = subprocess.run(("git", *words), check=False, cwd=ROOT, capture_output=True, text=True)
    return done.stdout


def test_in_no_commit_a_ceiling_has_risen_without_a_growth():
    """Each version of the file ceilings.toml, as Git has it, is compared with the one before, and
    the file as it stands with the latest commit: a ceiling may rise only by as much as entries
    under `growth`, which give reasons, have come with it."""
    name = "tests/ceilings.toml"
    versions = [CEILINGS]
    for commit in git("log", "--format=%h", "--", name).split():
        versions.append(tomllib.loads(git("show", f"{commit}:{name}")))

    found = []
    for after, before in itertools.pairwise(versions):
        found += unexplained_rises(before, after)

    check_empty(found)


def test_rooms_import_each_other_in_no_circle():
    check_empty(layout.circles(layout.arrows()))


def test_the_package_has_few_rooms_and_few_imports_between_them():
    assert len(layout.arrows()) <= MOST_ROOMS, sorted(layout.arrows())
    assert sum(map(len, layout.arrows().values())) <= MOST_ARROWS, {
        room: sorted(others) for room, others in layout.arrows().items()
    }


def test_only_the_command_imports_applications():
    check_empty(layout.importers_of_applications() - {"roboirg.main"})


def test_applications_do_not_import_each_other():
    check_empty(layout.imports_between_applications())


@pytest.fixture(scope="module")
def names_for_packages():
    """The names of the benchmark, with their modules, that the packages next to it import."""
    names = set()
    for path in set(ALL_SOURCE_FILES) - set(SOURCES):
        for node in ast.walk(layout.tree(path)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("roboirg."):
                names |= {f"{node.module}.{alias.name}" for alias in node.names}
            elif isinstance(node, ast.Attribute) and getattr(node.value, "id", "") == "roboirg":
                names.add(f"roboirg.{node.attr}")
    return names


def test_packages_import_names_of_the_extension_modules_alone(names_for_packages):
    """The packages next to the benchmark use `roboirg.NAME` and `roboirg.extension.MODULE.NAME`:
    what is behind these modules can change, and a package that imports it would break."""
    allowed = re.compile(r"roboirg(\.extension\.\w+)?\.\w+")

    check_empty(name for name in names_for_packages if not allowed.fullmatch(name))


def test_names_that_packages_import_are_documented(names_for_packages):
    """The page about the architecture lists, in code quotes, each name of the benchmark that other
    packages may import."""
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")

    check_empty(name for name in names_for_packages if f"`{name.split('.')[-1]}`" not in page)


def test_packages_import_few_names(names_for_packages):
    """The packages next to the benchmark import 53 names of it, and shall not need more. Fewer than
    40 would mean that this test has not found them."""
    assert 40 < len(names_for_packages) <= 53


def test_no_text_below_the_applications_names_one():
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for module, path in layout.modules().items()
        if layout.room_of(module) not in ("apps", "main")
        for line, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if layout.APPS in text
    ]
    check_empty(found)


def test_reader_records_and_stats_import_only_the_rooms_that_they_may():
    for room, others in MAY_IMPORT.items():
        assert layout.arrows()[room].keys() <= others, room


def test_no_room_but_the_package_itself_imports_the_api():
    assert [room for room, others in layout.arrows().items() if "api" in others] == ["roboirg"]


def test_the_table_of_rooms_is_up_to_date():
    page = layout.PAGE.read_text(encoding="utf-8")
    assert page == layout.page_text(), "write it anew: python scripts/layout.py"


def repeated(places):
    return [f"{name}: {', '.join(found)}" for name, found in places.items() if len(found) > 1]


def test_every_class_has_a_name_of_its_own():
    """Two classes with one name, anywhere in the benchmark or in the packages next to it, would be
    mistaken for each other; they are listed with their places."""
    places = defaultdict(list)
    for path in ALL_SOURCE_FILES:
        for node in ast.walk(layout.tree(path)):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(f"{path.relative_to(ROOT)}:{node.lineno}")
    check_empty(repeated(places))


def test_no_message_has_a_plural_verb_after_a_count_that_may_be_one():
    """As "1 episode are missing"; `plain_text.verb_for` gives the right verb."""
    found = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path in ALL_SOURCE_FILES
        for match in re.finditer(
            r"counted\([^{}]*\)\} (are|were|have|do)\b", path.read_text("utf-8")
        )
    ]
    check_empty(found)


def test_inside_a_room_no_file_imports_from_a_folder_above_its_own():
    check_empty(layout.imports_back_up())
