"""What results should have in common, and sentences on everything in which they differ."""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any, NamedTuple

from roboirg.core.environment_options import ENVIRONMENT_OPTIONS
from roboirg.core.versions import makeup_text
from roboirg.core.word_pools import words_label
from roboirg.evaluation.records.record import Summary


class Trait(NamedTuple):
    """What should be the same in all results, or in all of a policy.

    Attributes:
        path: of the field of a result.
        plural: what several values are called.
        meaning: of several values.
        text: returns a value in words, or None if it fits all others.
        owner: returns what of a result has the value; only its values should be the same.
    """

    path: str
    plural: str
    meaning: str
    text: Callable[[Any], str | None] = str
    owner: Callable[[Any], str] = lambda _: ""


_UNFAIR = "They are kept apart and cannot be compared."
_APART = "They are kept apart and never averaged."

FAIRNESS = (
    Trait("split", "splits", _UNFAIR),
    Trait("options.wordings", "words", _UNFAIR, words_label),
    Trait("environment.max_steps", "step limits", _UNFAIR),
    Trait("environment.meshes", "kinds of meshes", _UNFAIR),
    Trait("arm", "arms", _UNFAIR),
    Trait("language_version", "versions of the language", _UNFAIR),
    Trait("environment_version", "versions of the environment", _UNFAIR),
    Trait(
        "words_version",
        "words of a task and pool",
        "They cannot be compared, and rates average over them.",
        owner=operator.attrgetter("words_owner"),
    ),
)
"""What must be equal in a comparison of policies."""

_COMMON = (
    Trait(
        "render_device",
        "render devices",
        "Their pictures differ in some pixels by a brightness level, and rates average over them.",
        lambda device: device,  # results for which nothing was rendered fit every device
    ),
    Trait("code", "states of the package's code", "Rates do not tell them apart."),
)
_OF_POLICY = (
    Trait("ref.makeup", "policies", _APART, makeup_text),
    Trait("played_version", "versions", _APART),
    *(
        Trait(path, name.replace("_", " "), _APART)
        for name in ENVIRONMENT_OPTIONS
        if (path := f"environment.{name}") not in {one.path for one in FAIRNESS}
    ),
)


def mixtures(results: Collection[Summary]) -> list[str]:
    """Return a sentence for everything that is not the same in all results, or of a policy."""
    found = [*differing(results, FAIRNESS), *differing(results, _COMMON)]
    for policy in sorted({one.policy for one in results}):
        own = [one for one in results if one.policy == policy]
        found += differing(own, _OF_POLICY, f" of {policy}")
    return found


def differing(
    results: Collection[Summary], traits: Iterable[Trait], owner: str = ""
) -> Iterator[str]:
    """Yield a sentence for each of some traits of which results have several values."""
    for trait in traits:
        value_of = operator.attrgetter(trait.path)
        texts: dict[str, set[str]] = {}
        for its_owner, value in {(trait.owner(result), value_of(result)) for result in results}:
            text = trait.text(value)
            if text is not None:
                texts.setdefault(its_owner, set()).add(str(text))
        for its_owner in sorted(texts):
            if len(texts[its_owner]) > 1:
                listed = ", ".join(sorted(texts[its_owner]))
                yield f"Mixed {trait.plural}{owner}: {listed}. {trait.meaning}"
