"""Structure and names of the package, read from its source."""

import ast
import io
import re
import tokenize
from collections import defaultdict
from pathlib import Path

import draw_layout
import layout
import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "roboirg"
SOURCES = sorted(PACKAGE.rglob("*.py"))

MOST_ROOMS = 16
MOST_ARROWS = 70

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
    "src/roboirg/apps/integrations/inspect/inspect_grounding.py": {"Sample"},
    "src/roboirg/apps/integrations/inspect/listener_task.py": {"Sample"},
}
"""Names of other packages' classes."""

SPOKEN = (
    "src/roboirg/language/rivals/rival_templates.py",
    "src/roboirg/language/templates/",
    "src/roboirg/policies/vlm/prompts/grounding_questions.toml",
    "src/roboirg/policies/vlm/prompts/listener.toml",
)
"""Words that are said to robots and models are data: changing them would change results."""
FORBIDDEN_PROSE = ("whoever", "nobody", "somebody", "anybody", "so many", "so often", "while due")


def check_empty(found):
    """Fail with a line for each entry."""
    if found:
        pytest.fail("\n".join(map(str, found)), pytrace=False)


def test_rooms_import_each_other_in_no_circle():
    check_empty(layout.circles(layout.arrows()))


def test_files_import_each_other_in_no_circle():
    check_empty(layout.file_circles())


def test_circles_are_found():
    assert layout.circles({"a": ["b"], "b": ["c"], "c": []}) == []
    assert layout.circles({"a": ["b", "c"], "b": ["c"], "c": ["b"]}) == [["b", "c"]]


def test_rooms_and_arrows_are_few():
    print("\n".join(f"{n:>7,} {name}" for name, n in layout.figures().items()))  # noqa: T201
    assert len(layout.arrows()) <= MOST_ROOMS, sorted(layout.arrows())
    assert sum(map(len, layout.arrows().values())) <= MOST_ARROWS, {
        room: sorted(others) for room, others in layout.arrows().items()
    }


def test_only_the_command_imports_applications():
    check_empty(layout.importers_of_applications() - {"roboirg.main"})


def test_applications_do_not_import_each_other():
    check_empty(layout.imports_between_applications())


def test_no_text_below_the_applications_names_one():
    found = [
        f"{path.relative_to(ROOT)}:{line}"
        for module, path in layout.modules().items()
        if layout.room_of(module) not in ("apps", "main")
        for line, text in enumerate(path.read_text(encoding="utf-8").splitlines(), 1)
        if layout.APPS in text
    ]
    check_empty(found)


def imported_below(room):
    """Return the rooms that a room reaches, directly or through others."""
    reached, left = set(), [room]
    while left:
        new = set(layout.arrows()[left.pop()]) - reached
        reached |= new
        left += new
    return reached


def test_records_are_read_without_tasks_or_words():
    folder = "roboirg.evaluation.records"
    found = [
        f"{one.source} imports {one.target}"
        for one in layout.imports()
        if one.source.startswith(folder) and not one.target.startswith(folder)
        if layout.room_of(one.target) not in ("core", "util")
    ]
    check_empty(found)


def test_the_picture_of_the_layout_is_up_to_date():
    drawn = draw_layout.FILE.read_text(encoding="utf-8")
    assert drawn == draw_layout.picture(), "draw it anew: python scripts/draw_layout.py"


def test_nothing_below_the_environments_imports_gymnasium():
    found = [
        str(path.relative_to(ROOT))
        for module, path in layout.modules().items()
        if layout.room_of(module) in imported_below("envs")
        and any(name.split(".")[0] == "gymnasium" for name in layout.imported_names(path))
    ]
    check_empty(found)


def repeated(places):
    return [f"{name}: {', '.join(found)}" for name, found in places.items() if len(found) > 1]


def test_every_class_has_a_name_of_its_own():
    places = defaultdict(list)
    for path in SOURCES:
        for node in ast.walk(layout.tree(path)):
            if isinstance(node, ast.ClassDef):
                places[node.name].append(f"{path.relative_to(ROOT)}:{node.lineno}")
    check_empty(repeated(places))


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


def forbidden_twins():
    """Return what the glossary's table of one spelling forbids, with what to write."""
    table = (ROOT / "docs" / "glossary.md").read_text("utf-8").split("| we write | not |\n")[1]
    rows = [line.strip("| ").split(" | ") for line in table.split("\n\n")[0].splitlines()[1:]]
    return [(twin, word) for word, twin in rows]


def test_no_page_has_a_forbidden_twin():
    pages = [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("docs/notebooks/*.ipynb")]
    read = {page: page.read_text("utf-8") for page in pages if page.name != "glossary.md"}
    twins = forbidden_twins()
    assert len(twins) > 5
    found = [
        f"{page.relative_to(ROOT)}: {match[0]!r}; write {word!r}"
        for twin, word in twins
        for page, text in read.items()
        for match in re.finditer(r"\b" + r"\s+".join(twin.split()) + r"s?\b", text)
    ]
    check_empty(found)


@pytest.mark.parametrize("twin", ["data set", "time line", "way-point", "2550", "tells the user"])
def test_no_program_has_a_forbidden_twin(twin):
    assert twin in dict(forbidden_twins())
    pattern = re.compile(r"\b" + r"[\s#]+".join(twin.split()) + r"s?\b", re.IGNORECASE)
    check_empty([path for path, text in texts() if path.suffix != ".md" and pattern.search(text)])


def test_no_text_of_the_program_says_beside():
    read = ("reader", "language", "policies/vlm/prompts")  # what people and models are asked with
    found = [
        path
        for path in sorted(PACKAGE.rglob("*"))
        if path.suffix in (".py", ".j2", ".toml", ".md")
        and not str(path.relative_to(PACKAGE)).startswith(read)
        and re.search(r"\bbeside\b", path.read_text("utf-8"))
    ]
    check_empty(found)


def test_the_verb_of_a_count_agrees_with_it():
    found = [
        f"{path.relative_to(ROOT)}: {match[0]}"
        for path in SOURCES
        for match in re.finditer(
            r"counted\([^{}]*\)\} (are|were|have|do)\b", path.read_text("utf-8")
        )
    ]
    check_empty(found)  # `plain_text.verb_for`


def test_inside_a_room_no_import_runs_back_up():
    check_empty(layout.imports_back_up())


def test_the_reader_imports_core_and_tasks_only():
    assert set(layout.arrows()["reader"]) <= {"core", "tasks"}
