"""What results have in common that rates do not tell apart, and whether it is mixed."""

from __future__ import annotations

import operator
from collections.abc import Collection
from typing import NamedTuple

from roboirg.evaluation.records.record import Summary


class _Mixture(NamedTuple):
    """A fact of results that should be the same in all of them, and what it means if it is not."""

    name: str
    plural: str
    meaning: str


_APART = "They are kept apart and never averaged."
_MIXTURES = (
    _Mixture("language_version", "versions of the language", _APART),
    _Mixture("environment_version", "versions of the environment", _APART),
    _Mixture(
        "render_device",
        "render devices",
        "Their pictures differ in some pixels by a brightness level, and rates average over them.",
    ),
)


def mixture_warnings(results: Collection[Summary]) -> list[str]:
    """Return a sentence for each version, and for the render device, that is not the same in all.

    Results for which nothing was rendered fit every device.
    """
    found = []
    for name, plural, meaning in _MIXTURES:
        read = operator.attrgetter(name)
        values = sorted(str(value) for value in {*map(read, results)} if value is not None)
        if len(values) > 1:
            found.append(f"Mixed {plural}: {', '.join(values)}. {meaning}")
    return found
