"""Entry points of other packages: what is taken, and what is refused in one sentence."""

import dataclasses
import importlib.metadata
from types import ModuleType

import pytest

from roboirg import tasks
from roboirg.core.errors import InvalidValueError
from roboirg.tasks import Task, get_task
from roboirg.util import discovery

TASK_OF_A_LAB = dataclasses.replace(get_task("PickXtimes"), name="Outside", suite="lab")
SECOND_TASK_OF_THE_LAB = dataclasses.replace(TASK_OF_A_LAB, name="Other")
MODULE_WITH_A_TASK = ModuleType("outside")
MODULE_WITH_A_TASK.TASK = TASK_OF_A_LAB


def raise_error():
    raise RuntimeError("out of order")


class EntryPoint:
    dist = type("Distribution", (), {"name": "a-lab"})

    def __init__(self, number, load):
        self.name = f"outside-{number}"
        self.value = "outside:TASK"
        self.load = load
        self.group = tasks.ENTRY_POINTS


@pytest.fixture
def install_entry_points(monkeypatch):
    """Make entry points the only ones that are installed; they are found in any order."""

    def add(*loads):
        entries = [EntryPoint(number, load) for number, load in enumerate(loads)][::-1]
        monkeypatch.setattr(importlib.metadata, "entry_points", lambda *, group: entries)

    return add


def tasks_found():
    return list(discovery.discover("roboirg.tasks", "TASK", Task, tasks.ENTRY_POINTS).values())


@pytest.mark.parametrize("thing", [TASK_OF_A_LAB, MODULE_WITH_A_TASK], ids=["object", "module"])
def test_another_packages_entry_point_may_name_a_task_or_the_module_that_has_it(
    install_entry_points, thing
):
    """An entry point is a name under which an installed package offers something."""
    own = discovery.discover_in_modules("roboirg.tasks", "TASK", Task)
    install_entry_points(lambda: thing, lambda: SECOND_TASK_OF_THE_LAB)

    found = tasks_found()

    assert found[-2:] == [TASK_OF_A_LAB, SECOND_TASK_OF_THE_LAB]
    assert len(found) == len(own) + 2


def test_an_entry_point_is_found_by_its_name(install_entry_points):
    """An entry point is a name under which an installed package offers something. Two are
    installed, named outside-0 and outside-1, each with a function that loads its task."""
    install_entry_points(lambda: TASK_OF_A_LAB, lambda: SECOND_TASK_OF_THE_LAB)

    found = discovery.find_entry("outside-1", "TASK", Task, tasks.ENTRY_POINTS)

    assert found is SECOND_TASK_OF_THE_LAB


@pytest.mark.parametrize(
    ("load", "sentence"),
    [
        (
            raise_error,
            r"'outside-0' \(outside:TASK\) of a-lab .*: RuntimeError: out of .*, line 21\)\.$",
        ),
        (lambda: 7, r"of a-lab in the group 'roboirg.tasks' is 7; it must be a Task, or a module"),
        (lambda: ModuleType("empty"), "is None; it must be a Task, or a module with one as TASK"),
        (lambda: get_task("BinFill"), "a-lab adds 'BinFill' .* a name that roboirg has; choose"),
        (lambda: SECOND_TASK_OF_THE_LAB, "a-lab adds 'Other' .* a name that a-lab has; choose"),
    ],
    ids=["raises", "no task", "empty module", "taken", "taken by another"],
)
def test_a_bad_entry_point_is_one_sentence_that_names_its_package(
    install_entry_points, load, sentence
):
    """Installed are a bad entry point, outside-0, and a good one with the task "Other", both of the
    package a-lab. `load` raises, gives no task, or one whose name is taken by the benchmark or
    by the good one."""
    get_task("BinFill")  # known before the entry points change
    install_entry_points(load, lambda: SECOND_TASK_OF_THE_LAB)

    with pytest.raises(InvalidValueError, match=sentence):
        tasks_found()


def test_a_task_of_another_package_may_not_join_a_suite_of_the_benchmark(install_entry_points):
    """Averages over the suite would change with what is installed."""
    install_entry_points(lambda: dataclasses.replace(TASK_OF_A_LAB, suite="counting"))
    with pytest.raises(InvalidValueError, match="Outside of another package is in the suite"):
        tasks._registry.__wrapped__()
