"""Parse names, numbers and ranges: as typed on a command line, or lists of YAML and Python."""

from __future__ import annotations

import functools
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import cast

from roboirg import language
from roboirg.core.arms import parse_arm
from roboirg.core.episode import DIFFICULTIES, SPLITS, Split
from roboirg.core.errors import InvalidValueError
from roboirg.tasks.splits import splits

Names = tuple[str, ...]
"""Different names, in the order in which they were given."""
Numbers = tuple[int, ...]
"""Different numbers, in the same way."""

ALL = "all"
"""The name that selects everything."""

_NAME = r"[\w.+ -]+"
"""Of a policy: it becomes part of names of files."""
_MAX_NUMBERS = 10_000
_NUMBER = r"(?:0|[1-9]\d{0,17})"
"""Without leading zeros: 010 is 8 to some readers."""
_MAX_QUOTED_LENGTH = 40
_NUMBERS_HINT = "write numbers and ranges such as 0,3,5-9"
_EPISODES_HINT = f"{_NUMBERS_HINT}, or all"


def parse_names(kind: str, given: object) -> Names:
    """Parse names, in a text separated by commas; repeated names count once.

    Args:
        kind: what the names are, for the error.
        given: as typed, or several of these, or a number alone.

    Raises:
        InvalidValueError: there is none, or they are in a mapping, whose values would be lost.
    """
    names = tuple(dict.fromkeys(word for word in _words(kind, given) if word))
    if not names:
        raise InvalidValueError(f"No {kind} was given.")
    return names


def _words(kind: str, given: object) -> list[str]:
    if given is None:
        return []
    if isinstance(given, Mapping):
        raise InvalidValueError(f"{_shorten(str(given))} is not a valid {kind}; write a list.")
    is_one = isinstance(given, str) or not isinstance(given, Iterable)
    parts: Iterable[object] = [given] if is_one else cast("Iterable[object]", given)
    return [word.strip() for one in parts for word in str(one).split(",")]


def parse_arms(given: object) -> Names:
    """Parse control arms; repeated ones count once.

    Raises:
        UnknownNameError: there is no such arm.
        InvalidValueError: there is none, or a number of paraphrases is out of range.
    """
    found = (arm for name in parse_names("arm", given) for arm in parse_arm(name))
    return tuple(dict.fromkeys(found))


def parse_policies(given: Iterable[str]) -> Names:
    """Parse policies; one text may hold several names separated by commas.

    Raises:
        InvalidValueError: there is none, or ``NAME=SPEC`` has a name that is not allowed.
    """
    found: list[str] = []
    for spec in given:
        # Addresses and their options may contain commas.
        if "://" in spec or "?" in spec:
            found.append(spec.strip())
        else:
            found += parse_names("policy", spec)
    policies = tuple(dict.fromkeys(found))
    if not policies:
        raise InvalidValueError("No policy was given.")
    for policy in policies:
        name, equals, _ = policy.partition("=")
        # Addresses have ":" or "?" before the first "=".
        if equals and not re.search("[:?]", name) and not re.fullmatch(_NAME, name):
            raise InvalidValueError(
                f"The name of a policy is {name!r} (in {policy!r}); a name has letters, digits, "
                "blanks and any of . _ + - only."
            )
    return policies


def name_and_spec(policy: str) -> tuple[str, str]:
    """Split ``NAME=SPEC`` into name and spec; without a name, the spec is the name."""
    found = re.fullmatch(rf"({_NAME})=(.+)", policy)
    return (policy, policy) if found is None else (found[1].strip(), found[2].strip())


def means_all(given: object) -> bool:
    """Return whether names contain ``all``."""
    return ALL in (word.lower() for word in _words("name", given))


def parse_splits(text: str) -> tuple[Split, ...]:
    """Return the splits of a name: train, val or test, or ``all`` of them."""
    return SPLITS if means_all(text) else (splits.check_fixed_split(text),)


def parse_episodes(given: object, split: str, tasks: Collection[str]) -> Numbers:
    """Parse episodes: ``4`` is the first four; with a comma or a dash it is a list of positions.

    So is a list. Its positions are not compared with the size of the split, which only those who
    know the salt of private episodes can draw.

    In a split of fixed episodes ``all`` is every one, and ``easy``, ``medium``, ``hard`` or several
    of them are those that have such a difficulty in all of the tasks.

    Raises:
        UnknownNameError: there is no such split.
        InvalidValueError: the text is neither a number nor a list, or the split has fewer episodes.
    """
    words = parse_names("episode", given)
    size = functools.partial(splits.split_size, split)
    if means_all(words) or {*words} <= {*DIFFICULTIES}:
        if split not in SPLITS:
            raise InvalidValueError(
                f"The split {split!r} has {size():,} episodes; say how many with --episodes."
            )
        levels = {*DIFFICULTIES} if means_all(words) else words
        return tuple(
            index
            for index in range(size())
            if all(splits.get_episode(task, split, index).difficulty in levels for task in tasks)
        )
    if isinstance(given, Iterable) and not isinstance(given, str):
        return _union(_parse_ranges("episode", words, _EPISODES_HINT))
    single = re.fullmatch(rf"\s*(-?)({_NUMBER})\s*", str(given))
    if single is None:
        ranges = _parse_ranges("episode", words, _EPISODES_HINT)
    else:
        count = int(single[2])
        if single[1] or count == 0:
            alone = "" if count else "; for episode 0 alone write '0,'"
            raise InvalidValueError(
                f"The number of episodes is {single[0].strip()}; it must be at least 1{alone}."
            )
        ranges = [range(count)]
    for numbers in ranges:
        if numbers[-1] >= size():
            raise InvalidValueError(
                f"There is no episode {numbers[-1]}: split {split!r} has episodes 0 to "
                f"{size() - 1}."
            )
    return _union(ranges)


def parse_stages(given: object) -> Numbers:
    """Parse stages of the contextual setting, such as ``1,5``."""
    sets = "; ".join(",".join(map(str, stages)) for stages in language.STAGE_SETS)
    return _union(_parse_ranges("list of stages", given, f"the possible lists are {sets}"))


def parse_stage_sets(given: object) -> tuple[Numbers, ...]:
    """Parse several lists of stages, such as ``1,5; 1-5``."""
    sets: Iterable[object] = [given]
    if isinstance(given, str):
        sets = given.split(";")
    elif isinstance(given, list | tuple) and not all(isinstance(stage, int) for stage in given):
        sets = given
    return tuple(dict.fromkeys(map(parse_stages, sets)))


def parse_numbers(kind: str, given: object) -> Numbers:
    """Parse numbers and ranges, in a text separated by commas, such as ``0,3,5-9``."""
    return _union(_parse_ranges(kind, given, _NUMBERS_HINT))


def _parse_ranges(kind: str, given: object, hint: str) -> list[range]:
    ranges = []
    for part in parse_names(kind, given):
        found = re.fullmatch(rf"({_NUMBER})(?:\s*-\s*({_NUMBER}))?", part)
        first, last = -1, -2
        if found is not None:
            first, last = int(found[1]), int(found[2] or found[1])
        if last < first:
            raise InvalidValueError(f"{_shorten(part)!r} is not a valid {kind}; {hint}.")
        ranges.append(range(first, last + 1))
    return ranges


def _union(ranges: Sequence[range]) -> Numbers:
    count = sum(map(len, ranges))
    if count > _MAX_NUMBERS:
        raise InvalidValueError(
            f"The list has {count:,} numbers; at most {_MAX_NUMBERS:,} are allowed."
        )
    return tuple(dict.fromkeys(number for numbers in ranges for number in numbers))


def _shorten(text: str) -> str:
    return text if len(text) <= _MAX_QUOTED_LENGTH else f"{text[:_MAX_QUOTED_LENGTH]}…"
