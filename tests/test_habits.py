"""Habits that make lines hard to read, counted room by room in what stands plainly already."""

import ast
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from house_rooms import ROOT, TESTS, house_files

LIMITS = tomllib.loads((Path(__file__).parent / "habits.toml").read_text("utf-8"))
COMPREHENSIONS = (ast.ListComp, ast.SetComp, ast.DictComp, ast.GeneratorExp)
LOOPS = (ast.For, ast.AsyncFor, ast.comprehension)


def is_truth(node):
    """Return whether an expression is true or false, and nothing else."""
    if isinstance(node, ast.Call):
        return isinstance(node.func, ast.Name) and node.func.id == "bool"
    if isinstance(node, ast.UnaryOp):
        return isinstance(node.op, ast.Not)
    return isinstance(node, ast.Compare | ast.BoolOp)


def is_trick(node):
    """Return whether it is a text times a truth, or a starred conditional."""
    if isinstance(node, ast.Starred):
        return isinstance(node.value, ast.IfExp)
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
        return is_truth(node.left) or is_truth(node.right)
    return False


def is_nested(comprehension):
    """Return whether another comprehension stands inside."""
    parts = list(ast.walk(comprehension))[1:]
    return any(isinstance(part, COMPREHENSIONS) for part in parts)


def is_pair_assignment(node):
    """Return whether several names get values of their own: ``a, b = x, y``."""
    if not isinstance(node, ast.Assign):
        return False
    return isinstance(node.targets[0], ast.Tuple) and isinstance(node.value, ast.Tuple)


def loop_names(node):
    """Return the names that a loop gives to what it goes through."""
    return [part.id for part in ast.walk(node.target) if isinstance(part, ast.Name)]


def habits_of(tree):
    """Return how often each habit stands in a file, with its statements and loop names."""
    found = Counter()
    for node in ast.walk(tree):
        if isinstance(node, ast.stmt):
            found["statements"] += 1
        if isinstance(node, ast.IfExp):
            found["conditionals"] += 1
        if isinstance(node, COMPREHENSIONS):
            found["comprehensions"] += 1
            found["nested"] += is_nested(node)
        if isinstance(node, LOOPS):
            names = loop_names(node)
            found["loop names"] += len(names)
            found["called one"] += names.count("one")
        found["pairs"] += is_pair_assignment(node)
        found["tricks"] += is_trick(node)
    return found


def habits_above_limits(folder, paths):
    """Return a line for each habit that the files of a folder have more often than they may."""
    found = Counter()
    for path in paths:
        found += habits_of(ast.parse(path.read_text("utf-8")))
    limits = LIMITS["plain"] | LIMITS["rooms"].get(folder, {})
    above = []
    for habit, limit in limits.items():
        allowed = limit * found["statements"] / 1000
        if habit == "called one":
            allowed = limit * found["loop names"] / 100
        if found[habit] > max(allowed, 1):
            above.append(f"{folder}: {found[habit]} {habit}; it may have {allowed:.0f}")
    return above


@pytest.mark.parametrize(
    ("code", "habit"),
    [
        ("text = 'a' * (b in c)", "tricks"),
        ("row = [*(a if b else c)]", "tricks"),
        ("rows = [[b for b in a] for a in c]", "nested"),
        ("a, b = c, d", "pairs"),
        ("for one in rows: pass", "called one"),
        ("a = b if c else d", "conditionals"),
    ],
)
def test_a_habit_is_found(code, habit):
    """Each line of code has once what makes lines dense. A text times a truth and a starred
    conditional are *tricks*, a comprehension in another one is *nested*, and several names that get
    values of their own are *pairs*."""
    assert habits_of(ast.parse(code))[habit] == 1


def test_what_is_plain_has_no_habit():
    """A loop, an assignment from one value and a product of numbers: only statements and loop names
    are counted."""
    plain = "for row in rows:\n    x, y = point\n    found.append(2 * row)\n"
    assert set(+habits_of(ast.parse(plain))) <= {"statements", "loop names"}


def test_no_folder_of_the_code_has_more_dense_lines_than_it_may():
    """Habits that make lines dense, such as a comprehension inside another one, are counted in the
    syntax trees of each folder of the package, of the tests, and of the scripts. The file
    habits.toml has how many are allowed in 1,000 statements; one of each always is."""
    folders = house_files()
    folders["tests"] = TESTS
    folders["scripts"] = sorted((ROOT / "scripts").rglob("*.py"))

    above = []
    for folder, paths in folders.items():
        above += habits_above_limits(folder, paths)

    assert above == []
