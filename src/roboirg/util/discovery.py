"""Find what files and installed packages define: adding a thing is adding a file."""

from __future__ import annotations

import importlib
import importlib.metadata
import pkgutil
from collections.abc import Collection, Iterable
from types import ModuleType
from typing import Any, Protocol, TypeVar

from roboirg.core.error_words import one_line
from roboirg.core.errors import InvalidValueError


class Named(Protocol):
    """Anything with a name that is unique in its registry."""

    @property
    def name(self) -> str:
        """The name."""


Thing = TypeVar("Thing", bound=Named)


def discover(package: str, attribute: str, kind: type[Thing], group: str) -> dict[str, Thing]:
    """Return what the modules of a package and the installed entry points define, by name.

    Args:
        package: name of ours; a module in it that has `attribute` defines one.
        attribute: for example ``"TASK"``.
        kind: the class that every one must be an instance of.
        group: of the entry points through which other packages add theirs, for example
            ``"roboirg.tasks"``. An entry point names the object, or the module that has it.

    Returns:
        Ours in the order of the modules' names, then those of other packages in the order of the
        entry points' names.
    """
    return with_entries(discover_in_modules(package, attribute, kind), attribute, kind, group)


def with_entries(
    ours: Iterable[Thing], attribute: str, kind: type[Thing], group: str
) -> dict[str, Thing]:
    """Return ours and what the installed entry points define, by name; see `discover`.

    Raises:
        InvalidValueError: an entry point cannot be loaded, or adds a name that exists already.
    """
    things = {thing.name: thing for thing in ours}
    owners = dict.fromkeys(things, "roboirg")
    for entry in entry_points_of(group):
        thing = _thing(entry, attribute, kind)
        if thing.name in owners:
            raise InvalidValueError(
                f"{_distribution(entry)} adds {thing.name!r} in the group {group!r}, a name that "
                f"{owners[thing.name]} has; choose another one."
            )
        owners[thing.name] = _distribution(entry)
        things[thing.name] = thing
    return things


def entry_names(group: str, packages: Collection[str] | None = None) -> tuple[str, ...]:
    """Return the names of the installed entry points of a group; nothing is imported.

    With packages, only of those that name something in one of them.
    """
    names = []
    for entry in entry_points_of(group):
        package = entry.module.partition(".")[0]
        if packages is None or package in packages:
            names.append(entry.name)
    return tuple(names)


def find_entry(name: str, attribute: str, kind: type[Thing], group: str) -> Thing | None:
    """Return what the entry point of a name defines; None if no package has one of that name.

    Imports that one only, so another package with a fault does no harm. The other arguments are
    those of `discover`.
    """
    for entry in entry_points_of(group):
        if entry.name == name:
            return _thing(entry, attribute, kind)
    return None


def discover_in_modules(package: str, attribute: str, kind: type[Thing]) -> list[Thing]:
    """Return what the modules of a package define, in the order of the modules' names.

    Imports all modules of `package`; those whose `attribute` is no `kind`, or that have none, count
    for nothing.
    """
    things = []
    for info in pkgutil.iter_modules(importlib.import_module(package).__path__):
        module = importlib.import_module(f"{package}.{info.name}")
        thing = getattr(module, attribute, None)
        if isinstance(thing, kind):
            things.append(thing)
    return things


def load_entry(entry: importlib.metadata.EntryPoint) -> Any:  # noqa: ANN401 - a stranger's
    """Return what an entry point names.

    Raises:
        InvalidValueError: it cannot be loaded; the message has the place of the error.
    """
    try:
        return entry.load()
    except (Exception, SystemExit) as error:  # a stranger's module
        raise InvalidValueError(f"{_where(entry)} cannot be loaded: {one_line(error)}.") from error


def _where(entry: importlib.metadata.EntryPoint) -> str:
    """Return an entry point in words, with what it names and whose it is."""
    return (
        f"The entry point {entry.name!r} ({entry.value}) of {_distribution(entry)} in the group "
        f"{entry.group!r}"
    )


def _thing(entry: importlib.metadata.EntryPoint, attribute: str, kind: type[Thing]) -> Thing:
    """Return what an entry point names: the object, or in a module the attribute of that name.

    The arguments are those of `discover`.
    """
    thing = load_entry(entry)
    if isinstance(thing, ModuleType):
        thing = getattr(thing, attribute, None)
    if not isinstance(thing, kind):
        raise InvalidValueError(
            f"{_where(entry)} is {thing!r}; it must be a {kind.__name__}, or a "
            f"module with one as {attribute}."
        )
    return thing


def entry_points_of(group: str) -> list[importlib.metadata.EntryPoint]:
    """Return the installed entry points of a group, sorted by name."""
    return sorted(importlib.metadata.entry_points(group=group), key=lambda entry: entry.name)


def _distribution(entry: importlib.metadata.EntryPoint) -> str:
    """Return the name of the package that an entry point belongs to."""
    if entry.dist is None:
        return "an unknown package"
    return entry.dist.name
