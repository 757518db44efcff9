"""Structure and names of the package, read from its source."""

import ast
import io
import itertools
import re
import tokenize
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "roboirg"
SOURCES = sorted(PACKAGE.rglob("*.py"))

MAX_ROOMS = 22
MAX_ARROWS = 125
MAX_FILES = 20

FORBIDDEN_MODULES = {
    "acceptance", "asking", "balance", "benchmark", "code", "deadman", "derived", "desk",
    "excerpts", "feel", "fitting", "grounding", "handed", "hands", "happenings", "hearing",
    "kinds", "leases", "ledger", "lettering", "library", "lines", "links", "listing", "moments",
    "notices", "planned", "proof", "retelling", "retrace", "ring", "senses", "sharing",
    "showing", "slips", "standing", "telling", "watching", "wishes", "words",
}  # fmt: skip

FORBIDDEN_IDENTIFIERS = {
    "Asker", "Began", "Board", "Chooser", "Company", "Contestant", "Courier", "Course", "DeadMan",
    "Desk", "Draft", "Drawable", "Excerpt", "Fault", "Film", "Finding", "HandedPolicy", "Ledger",
    "MOST_STILLBORN", "MadeUpEpisode", "PASSING", "PlannedPolicy", "Play", "Player", "Rules",
    "Said", "Sample", "Seat", "Senses", "Slip", "Spell", "Studio", "Telling", "Trace", "Wishes",
    "blame", "course", "dead_man", "ending", "excuse", "felt", "happenings", "kept_arrays",
    "ledger", "lettering", "mistake", "offered", "perform", "retelling", "retrace", "send_limit",
    "slips", "wishes",
}  # fmt: skip
"""A leading underscore makes no difference."""

LENT = {
    "src/roboirg/integrations/inspect_grounding.py": {"Sample"},
    "src/roboirg/integrations/inspect/listener_task.py": {"Sample"},
}
"""Names of other packages' classes."""

SPOKEN = (
    "src/roboirg/language/templates/",
    "src/roboirg/policies/planning/prompts/grounding_questions.toml",
    "src/roboirg/policies/planning/prompts/listener.toml",
)
"""Words that are said to robots and models are data: changing them would change results."""
FORBIDDEN_PROSE = ("whoever", "nobody", "somebody", "anybody", "so many", "so often", "while due")


@cache
def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def module_name(path):
    parts = path.relative_to(PACKAGE.parent).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


MODULES = {module_name(path) for path in SOURCES}


def check_empty(found):
    """Fail with a line for each entry."""
    if found:
        pytest.fail("\n".join(map(str, found)), pytrace=False)


def room_of(module):
    """The top-level folder or module below the package; the package's own file is a room too."""
    return module.split(".")[1] if "." in module else module


def imports(path):
    """Yield every module of the package that a file imports, at any level of nesting."""
    package = module_name(path) if path.name == "__init__.py" else module_name(path.parent / "x")
    package = package.removesuffix(".x")
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                parent = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*parent, *filter(None, [base])])
            names = []
            for alias in node.names:
                submodule = f"{base}.{alias.name}"
                names.append(submodule if submodule in MODULES else base)
        else:
            continue
        yield from (name for name in names if name.split(".")[0] == PACKAGE.name)


@cache
def arrows():
    """Return the rooms that each room imports, with an example of each import."""
    found = {room_of(module): {} for module in MODULES}
    for path in SOURCES:
        room = room_of(module_name(path))
        for module in imports(path):
            if room_of(module) != room:
                found[room].setdefault(room_of(module), f"{path.relative_to(ROOT)}: {module}")
    return found


def find_circle(graph):
    """Return the rooms of a circle; empty if there is none."""
    finished, trail = set(), []

    def visit(room):
        if room in trail:
            return [*trail[trail.index(room) :], room]
        if room in finished:
            return []
        trail.append(room)
        for other in graph.get(room, ()):
            if circle := visit(other):
                return circle
        trail.pop()
        finished.add(room)
        return []

    return next((circle for room in graph if (circle := visit(room))), [])


def test_rooms_import_each_other_in_no_circle():
    circle = find_circle(arrows())
    check_empty([arrows()[one][other] for one, other in itertools.pairwise(circle)])


def test_circles_are_found():
    assert find_circle({"a": ["b"], "b": ["c"], "c": []}) == []
    assert find_circle({"a": ["b", "c"], "b": ["c"], "c": ["b"]}) == ["b", "c", "b"]


def test_rooms_and_arrows_are_few():
    assert len(arrows()) <= MAX_ROOMS, sorted(arrows())
    assert sum(map(len, arrows().values())) <= MAX_ARROWS, {
        room: sorted(others) for room, others in arrows().items()
    }


def test_folders_are_small():
    sizes = {
        str(folder.relative_to(ROOT)): sum(one.is_file() for one in folder.iterdir())
        for folder in (PACKAGE, *PACKAGE.rglob("*"))
        if folder.is_dir() and folder.name != "__pycache__"
    }
    check_empty([f"{folder}: {size}" for folder, size in sizes.items() if size > MAX_FILES])


def repeated(places):
    return [f"{name}: {', '.join(found)}" for name, found in places.items() if len(found) > 1]


def test_every_module_has_a_name_of_its_own():
    places = defaultdict(list)
    for path in SOURCES:
        if path.stem != "__init__":
            places[path.stem].append(str(path.relative_to(ROOT)))
    check_empty(repeated(places))


def test_every_class_has_a_name_of_its_own():
    places = defaultdict(list)
    for path in SOURCES:
        for node in ast.walk(tree(path)):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(f"{path.relative_to(ROOT)}:{node.lineno}")
    check_empty(repeated(places))


def test_no_module_has_a_forbidden_name():
    found = [
        path.relative_to(ROOT)
        for path in SOURCES
        if {path.stem, path.parent.name} & FORBIDDEN_MODULES
    ]
    check_empty(found)


def test_no_identifier_is_forbidden():
    found = [
        f"{path.relative_to(ROOT)}:{token.start[0]}: {token.string}"
        for path in SOURCES
        for token in tokenize.generate_tokens(io.StringIO(path.read_text("utf-8")).readline)
        if token.type == tokenize.NAME
        and token.string.lstrip("_") in FORBIDDEN_IDENTIFIERS
        and token.string not in LENT.get(str(path.relative_to(ROOT)), ())
    ]
    check_empty(found)


def texts():
    for folder in (PACKAGE, ROOT / "docs"):
        for path in sorted(folder.rglob("*")):
            if path.suffix in (".py", ".md", ".j2", ".html", ".css", ".js", ".toml", ".json"):
                yield path, path.read_text(encoding="utf-8")


@pytest.mark.parametrize("phrase", FORBIDDEN_PROSE)
def test_no_prose_has_a_forbidden_phrase(phrase):
    # Lines of a paragraph may break inside a phrase, in comments too.
    pattern = re.compile(r"\b" + r"[\s#]+".join(phrase.split()) + r"\b", re.IGNORECASE)
    found = [
        f"{path.relative_to(ROOT)}:{text.count(chr(10), 0, match.start()) + 1}"
        for path, text in texts()
        if not str(path.relative_to(ROOT)).startswith(SPOKEN)
        for match in pattern.finditer(text)
    ]
    check_empty(found)


def public_definitions(node):
    """Yield the public functions and classes of a module or class, without those in functions."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
            if child.name.startswith("_"):
                continue
            yield child
            if isinstance(child, ast.ClassDef):
                yield from public_definitions(child)
        elif isinstance(child, ast.If | ast.Try):
            yield from public_definitions(child)


def is_overload(node):
    decorators = getattr(node, "decorator_list", [])
    return any(ast.unparse(one).endswith("overload") for one in decorators)


@pytest.mark.parametrize("path", SOURCES, ids=module_name)
def test_modules_and_public_names_have_docstrings(path):
    text = path.read_text(encoding="utf-8")
    missing = [] if ast.get_docstring(tree(path)) or not text.strip() else ["module"]
    missing += [
        f"{node.name}, line {node.lineno}"
        for node in public_definitions(tree(path))
        if not ast.get_docstring(node) and not is_overload(node)
    ]
    check_empty(missing)
