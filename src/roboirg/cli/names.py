"""Names that were typed, as names of tasks, settings and the like."""

from __future__ import annotations

from collections.abc import Sequence

from roboirg.core.errors import Name, known_name


def known_tasks(given: object, wordings: str | None = None) -> tuple[str, ...]:
    """Return the names of the tasks that were typed or that a plan names, such as ``all``.

    Args:
        given: names of tasks or suites: a text with commas, or a list.
        wordings: identity of a wording file, which has sentences that others wrote. If it is given,
            ``all`` means only the tasks for which it has sentences. None, or a pool of ours,
            changes nothing.

    Raises:
        InvalidValueError: there is no such task or suite.
    """
    from roboirg.core.word_pools import outside_words
    from roboirg.language.scenarios.wording_store import find_wordings
    from roboirg.runs.plan.option_parsing import means_all, parse_names
    from roboirg.tasks import find_tasks

    names = find_tasks(parse_names("task", given))
    identity = outside_words(wordings)
    if identity is None or not means_all(given):
        return names
    tasks = find_wordings(identity).tasks
    return tuple(name for name in names if name in tasks)


def known_settings(given: object, tasks: Sequence[str]) -> tuple[str, ...]:
    """Return settings as typed or in a plan.

    Args:
        given: names or groups of settings.
        tasks: that must have all settings of a list without groups.
    """
    from roboirg.language.settings import check_named_settings, find_settings
    from roboirg.runs.plan.option_parsing import parse_names

    words = parse_names("setting", given)
    found = find_settings(words)
    check_named_settings(words, tasks)
    return found


def known_names(kind: str, given: object, known: Sequence[Name]) -> tuple[Name, ...]:
    """Return the names that were typed, separated by commas; ``all`` means all that are known.

    ``"floor", "chance, oracle"`` -> ``("chance", "oracle")``.

    Args:
        kind: what they name, for errors.
        given: text as typed, or a list of a plan.
        known: every valid name.

    Raises:
        UnknownNameError: a name is none of them.
    """
    from roboirg.runs.plan.option_parsing import means_all, parse_names

    if means_all(given):
        return tuple(known)
    return tuple(known_name(kind, name, known) for name in parse_names(kind, given))
