"""Structure and names of the package, read from its source."""

import ast
import gc
import itertools
import re
import subprocess
import tomllib
from collections import Counter, defaultdict
from typing import NamedTuple

import draw_layout
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
MOST_NAMES = 53
"""Of the benchmark, that the packages next to it import."""

MAY_IMPORT = {"reader": {"core", "tasks"}, "records": {"core", "util"}, "stats": {"core"}}
"""The reader is evidence; records are read without tasks or words; statistics need numbers."""

CEILINGS = ROOT / "tests" / "ceilings.toml"
PAGE_CODE = (".js", ".css", ".j2", ".html")
DATA = (".toml", ".yaml", ".yml")
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


def test_the_code_of_each_room_stays_below_its_ceiling():
    """A room is a folder of the package; size is counted in nodes of the syntax tree."""
    ceilings = tomllib.loads(CEILINGS.read_text("utf-8"))
    sizes = {room: size_of(paths) for room, paths in house_files().items()}
    nodes = sum(size.nodes for size in sizes.values())
    statements = sum(size.statements for size in sizes.values())
    counts = {f"rooms.{room}": size.nodes for room, size in sizes.items()}
    counts["nodes_a_statement"] = nodes / statements
    counts["nodes_of_tests"] = size_of(TESTS).nodes
    counts["nodes_of_scripts"] = size_of(sorted((ROOT / "scripts").rglob("*.py"))).nodes
    counts["lines_of_page_code"] = lines_of(PAGE_CODE)
    counts["lines_of_data"] = lines_of(DATA)
    allowed = Counter({f"rooms.{room}": most for room, most in ceilings.pop("rooms").items()})
    whole = ceilings.pop("nodes")

    assert sum(allowed.values()) == whole, "the rooms' ceilings add up to the whole's"

    del ceilings["growth"]
    allowed.update(ceilings)
    found = []
    for name, count in counts.items():
        if count > allowed[name]:
            found.append(f"{name} has {count:,.2f}; it may have {allowed[name]:,}: let things go")

    check_empty(found)


def test_a_ceiling_is_raised_only_with_a_growth_that_gives_the_reason():
    """Over all commits of the file of ceilings."""

    def git(*words):
        done = subprocess.run(
            ("git", *words), check=False, cwd=ROOT, capture_output=True, text=True
        )
        return done.stdout

    name = str(CEILINGS.relative_to(ROOT))
    commits = git("log", "--format=%h", "--", name).split()
    stored = [tomllib.loads(git("show", f"{commit}:{name}")) for commit in commits]
    newest = tomllib.loads(CEILINGS.read_text("utf-8"))
    found = []

    for after, before in itertools.pairwise([newest, *stored]):
        known = before.get("growth", [])
        new = [growth for growth in after.get("growth", []) if growth not in known]
        for key in before.keys() & after.keys() - {"rooms", "growth"}:
            most = before[key] + sum(growth.get(key, 0) for growth in new)
            if after[key] > most:
                found.append(f"{key} rose from {before[key]} to {after[key]}; it may have {most}")

    check_empty(found)


def test_rooms_import_each_other_in_no_circle():
    check_empty(layout.circles(layout.arrows()))


def test_files_import_each_other_in_no_circle():
    check_empty(layout.file_circles())


def test_the_package_has_few_rooms_and_few_imports_between_them():
    assert len(layout.arrows()) <= MOST_ROOMS, sorted(layout.arrows())
    assert sum(map(len, layout.arrows().values())) <= MOST_ARROWS, {
        room: sorted(others) for room, others in layout.arrows().items()
    }


def test_only_the_command_imports_applications():
    check_empty(layout.importers_of_applications() - {"roboirg.main"})


def test_applications_do_not_import_each_other():
    check_empty(layout.imports_between_applications())


def test_packages_import_documented_names_alone():
    """What is behind the facades can change: a package that imports it would break."""
    names = set()
    for path in ALL_SOURCE_FILES[len(SOURCES) :]:
        for node in ast.walk(layout.tree(path)):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("roboirg."):
                names |= {(node.module, alias.name) for alias in node.names}
            elif isinstance(node, ast.Attribute) and getattr(node.value, "id", "") == "roboirg":
                names.add(("roboirg", node.attr))
    page = (ROOT / "docs" / "architecture.md").read_text("utf-8")
    known = re.compile(r"roboirg(\.extension\.\w+)?")

    found = [
        name for name in sorted(names) if f"`{name[1]}`" not in page or not known.fullmatch(name[0])
    ]

    check_empty(found)
    assert 40 < len(names) <= MOST_NAMES


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


def test_the_picture_of_the_layout_is_up_to_date():
    drawn = draw_layout.FILE.read_text(encoding="utf-8")
    assert drawn == draw_layout.picture(), "draw it anew: python scripts/draw_layout.py"


def repeated(places):
    return [f"{name}: {', '.join(found)}" for name, found in places.items() if len(found) > 1]


def test_every_class_has_a_name_of_its_own():
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
