"""What results should have in common, and sentences on everything in which they differ."""

from __future__ import annotations

import operator
from collections.abc import Callable, Collection, Iterable, Iterator
from typing import Any, NamedTuple

from roboirg.core.environment_options import ENVIRONMENT_OPTIONS
from roboirg.core.versions import makeup_text
from roboirg.core.word_pools import words_label
from roboirg.records.record import Summary


class Trait(NamedTuple):
    """What should be the same in all results, or in all of a policy.

    Attributes:
        path: of the field of a result, such as ``environment.max_steps``.
        plural: what several values are called.
        meaning: a sentence on what it means that there are several.
        text: returns a value in words, or None if it fits all others.
        owner: returns what of a result has the value; only values of one owner should be the same.
            It is always "" if those of all results should.
    """

    path: str
    plural: str
    meaning: str
    text: Callable[[Any], str | None] = str
    owner: Callable[[Any], str] = lambda _result: ""


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
        "words",
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
    Trait(
        "verdict_code",
        "states of the code that decides verdicts",
        "Rates average over them.",
        lambda fingerprint: fingerprint,  # earlier records lack it and fit every state
    ),
)
_PACKAGE = Trait(
    "package_version",
    "versions of roboirg",
    "Other code may decide verdicts, and rates average over them.",
)
"""What must be equal as well if some results lack the fingerprint of what decides verdicts."""


def _environment_traits() -> list[Trait]:
    """Return a trait for each option of the environment that may differ between policies.

    Those in `FAIRNESS` must not differ.
    """
    fairness_paths = {trait.path for trait in FAIRNESS}
    traits = []
    for name in ENVIRONMENT_OPTIONS:
        path = f"environment.{name}"
        if path not in fairness_paths:
            traits.append(Trait(path, name.replace("_", " "), _APART))
    return traits


_OF_POLICY = (
    Trait("ref.makeup", "policies", _APART, makeup_text),
    Trait("played_version", "versions", _APART),
    *_environment_traits(),
)
"""What must be equal in all results of a policy."""

_read_compared = operator.attrgetter(
    "policy",
    "task",
    *(trait.path for trait in (*FAIRNESS, *_COMMON, _PACKAGE, *_OF_POLICY)),
)
"""Returns all that is compared here of a result, and what owns its words."""


def mixtures(results: Collection[Summary]) -> list[str]:
    """Return a warning for each property in which results differ that are compared or averaged.

    ``["Mixed splits: test, val. They are kept apart and cannot be compared."]``; empty if nothing
    is mixed. Some properties, such as the split, should be the same in all results, others, such as
    a policy's version, only in those of one policy.
    """
    distinct = _distinct(results)
    sentences = [*differing(distinct, FAIRNESS), *differing(distinct, _COMMON)]
    if any(result.verdict_code is None for result in distinct):
        sentences += differing(distinct, [_PACKAGE])
    for policy in sorted({result.policy for result in distinct}):
        of_policy = [result for result in distinct if result.policy == policy]
        sentences += differing(of_policy, _OF_POLICY, f" of {policy}")
    return sentences


def differing(
    results: Collection[Summary], traits: Iterable[Trait], of_whom: str = ""
) -> Iterator[str]:
    """Yield a sentence for each property that is not the same in all results.

    For example ``Mixed splits: test, val. They are kept apart and cannot be compared.``

    Args:
        results: in which the properties should be the same.
        traits: the properties; one with an `owner` only has to be the same in results of one owner,
            such as the words in results of one task and pool. A value whose text is None fits all
            others.
        of_whom: stands behind the property in a sentence, such as `` of mine``.
    """
    distinct = _distinct(results)
    for trait in traits:
        value_of = operator.attrgetter(trait.path)
        texts: dict[str, set[str]] = {}  # values in words, by owner
        for result in distinct:
            text = trait.text(value_of(result))
            if text is not None:
                texts.setdefault(trait.owner(result), set()).add(str(text))
        for owner in sorted(texts):
            if len(texts[owner]) > 1:
                listed = ", ".join(sorted(texts[owner]))
                yield f"Mixed {trait.plural}{of_whom}: {listed}. {trait.meaning}"


def _distinct(results: Iterable[Summary]) -> Collection[Summary]:
    """Return one of all results that agree in everything that is compared here."""
    return {_read_compared(result): result for result in results}.values()
