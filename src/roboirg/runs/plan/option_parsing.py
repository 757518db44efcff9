"""Parse names, numbers and ranges: as typed on a command line, or lists of YAML and Python."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from typing import NamedTuple, TypeVar

from roboirg import language
from roboirg.core.arms import parse_arm
from roboirg.core.episode import DIFFICULTIES, SPLITS, Split
from roboirg.core.errors import InvalidValueError
from roboirg.tasks.splits import splits

Value = TypeVar("Value")

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
_RANGE = re.compile(rf"(?P<first>{_NUMBER})(?:\s*-\s*(?P<last>{_NUMBER}))?")
"""``7``, or ``5-9``."""
_MAX_QUOTED_LENGTH = 40
_NUMBERS_HINT = "write numbers and ranges such as 0,3,5-9"
_EPISODES_HINT = f"{_NUMBERS_HINT}, or all"


def parse_names(kind: str, given: object) -> Names:
    """Return the names in a text separated by commas or in a list; repeated ones count once.

    ``"a, b"`` and ``["a,b", "a"]`` are ``("a", "b")``.

    Args:
        kind: what the names are, for the error.
        given: as typed, or several of these, or a number alone.

    Raises:
        InvalidValueError: there is none, or they are in a mapping, whose values would be lost.
    """
    names = distinct(word for word in _words(kind, given) if word)
    if not names:
        raise InvalidValueError(f"No {kind} was given.")
    return names


def _words(kind: str, given: object) -> list[str]:
    """Return the words of a typed value, split at commas.

    ``"a, b"``, ``["a", "b"]`` and ``["a,b"]`` all become ``["a", "b"]``; None has no words.

    Args:
        kind: what the words are, for the error.
        given: as typed, a list of these, or a number.
    """
    if given is None:
        return []
    if isinstance(given, Mapping):
        raise InvalidValueError(f"{_shorten(str(given))} is not a valid {kind}; write a list.")
    parts: Iterable[object] = [given]
    if isinstance(given, Iterable) and not isinstance(given, str):
        parts = given
    words = []
    for part in parts:
        words += [word.strip() for word in str(part).split(",")]
    return words


def distinct(values: Iterable[Value]) -> tuple[Value, ...]:
    """Return values in their order, repeated ones once."""
    return tuple(dict.fromkeys(values))


def parse_arms(given: object) -> Names:
    """Parse control arms; repeated ones count once.

    Raises:
        UnknownNameError: there is no such arm.
        InvalidValueError: there is none, or a number of paraphrases is out of range.
    """
    arms: list[str] = []
    for name in parse_names("arm", given):
        arms += parse_arm(name)
    return distinct(arms)


def parse_forms(given: object) -> Names:
    """Return the names of forms as typed; ``both`` means both, and so does ``all``."""
    names = parse_names("form", given)
    return language.FORMS if names == ("both",) or means_all(given) else names


def parse_policies(given: Iterable[str]) -> Names:
    """Return policies as they are typed, each once: ``NAME``, ``NAME=SPEC`` or an address.

    A text may hold several, separated by commas: ``"oracle,mine=lab:Walk"`` has two. Addresses and
    what has options stand in texts of their own.

    Raises:
        InvalidValueError: there is none, or ``NAME=SPEC`` has a name that is not allowed.
    """
    found = []
    for text in given:
        # Addresses and their options may contain commas.
        if "://" in text or "?" in text:
            found.append(text.strip())
        else:
            found += parse_names("policy", text)
    policies = distinct(found)
    if not policies:
        raise InvalidValueError("No policy was given.")
    for policy in policies:
        name, equals, _ = policy.partition("=")
        # An address has ":" or "?" before its first "=", as "openpi://host?a=1"; "mine=lab:Walk"
        # begins with a name.
        is_address = re.search("[:?]", name)
        if equals and not is_address and not re.fullmatch(_NAME, name):
            raise InvalidValueError(
                f"The name of a policy is {name!r} (in {policy!r}); a name has letters, digits, "
                "blanks and any of . _ + - only."
            )
    return policies


class NamedSpec(NamedTuple):
    """A policy as it is typed: its name in records, and the spec that says what it is."""

    name: str
    spec: str


def name_and_spec(policy: str) -> NamedSpec:
    """Split ``NAME=SPEC`` into name and spec; without a name, the spec is the name."""
    found = re.fullmatch(rf"(?P<name>{_NAME})=(?P<spec>.+)", policy)
    if found is None:
        return NamedSpec(policy, policy)
    return NamedSpec(found["name"].strip(), found["spec"].strip())


def means_all(given: object) -> bool:
    """Return whether names contain ``all``, in capitals or not."""
    return ALL in [word.lower() for word in _words("name", given)]


def parse_splits(text: str) -> tuple[Split, ...]:
    """Return the splits of a name: train, val or test, or ``all`` of them."""
    if means_all(text):
        return SPLITS
    return (splits.check_fixed_split(text),)


def parse_episodes(given: object, split: str, tasks: Collection[str]) -> Numbers:
    """Return the positions of episodes in a split, from what was typed.

    | typed | selects |
    | --- | --- |
    | ``4``, a number alone | the first four |
    | ``0,3,5-9``; ``7,`` | the positions |
    | ``hard``; ``easy,hard`` | those that have such a difficulty in all of the tasks |
    | ``hard,7`` | both |
    | ``all`` | every one |

    A list of Python or YAML has the same items. Its positions are not compared with the size of the
    split: that of a private one is not known everywhere.

    Args:
        given: as typed, or a list.
        split: name of the split; difficulties and ``all`` need one with fixed episodes.
        tasks: whose episodes must have the difficulty.

    Raises:
        UnknownNameError: there is no such split.
        InvalidValueError: the text is neither a number nor a list, or the split has fewer episodes.
    """
    words = parse_names("episode", given)
    if means_all(words):
        return _episodes_of_levels(DIFFICULTIES, split, tasks)
    levels = [word for word in words if word in DIFFICULTIES]
    positions = [word for word in words if word not in DIFFICULTIES]

    ranges = _ranges_of(positions, given)
    if isinstance(given, str | int):
        _check_positions(ranges, split)
    found: list[int] = []
    if levels:
        found += _episodes_of_levels(levels, split, tasks)
    found += _union(ranges)
    return distinct(found)


def _ranges_of(positions: Sequence[str], given: object) -> Sequence[range]:
    """Return the episodes that positions stand for: ``7`` is ``[7, 8)``, ``0-2`` is ``[0, 3)``.

    Only if a number alone is `given`, it is how many: ``4`` is ``[0, 4)``; a negative one is
    refused as such.
    """
    if re.fullmatch(rf"-?{_NUMBER}", str(given).strip()):
        return [_first_episodes(positions[0])]
    if not positions:
        return []
    return _parse_ranges("episode", positions, _EPISODES_HINT)


def _check_positions(ranges: Iterable[range], split: str) -> None:
    """Raise if a split has fewer episodes than some positions need; none of the ranges is empty."""
    size = splits.split_size(split)
    last = max((numbers[-1] for numbers in ranges), default=-1)
    if last >= size:
        raise InvalidValueError(
            f"There is no episode {last}: split {split!r} has episodes 0 to {size - 1}."
        )


def _first_episodes(count: str) -> range:
    """Return the first episodes, as many as a typed number says: ``"4"`` gives 0 to 3."""
    number = int(count)
    if number < 1:
        hint = "; for episode 0 alone write '0,'" if number == 0 else ""
        raise InvalidValueError(f"The number of episodes is {count}; it must be at least 1{hint}.")
    return range(number)


def _episodes_of_levels(levels: Collection[str], split: str, tasks: Collection[str]) -> Numbers:
    """Return the positions of the episodes with one of these difficulties in every task.

    Args:
        levels: difficulties, such as ``hard``.
        split: name of a split with fixed episodes.
        tasks: names.
    """
    size = splits.split_size(split)
    if split not in SPLITS:
        raise InvalidValueError(
            f"The split {split!r} has {size:,} episodes; say how many with --episodes."
        )
    episodes = []
    for index in range(size):
        difficulties = {splits.get_episode(task, split, index).difficulty for task in tasks}
        if difficulties <= {*levels}:
            episodes.append(index)
    return tuple(episodes)


def parse_stages(given: object) -> Numbers:
    """Parse stages of the contextual setting, such as ``1,5``."""
    possible = "; ".join(",".join(map(str, stages)) for stages in language.STAGE_SETS)
    return _union(_parse_ranges("list of stages", given, f"the possible lists are {possible}"))


def parse_stage_sets(given: object) -> tuple[Numbers, ...]:
    """Return sets of stages of a discourse: ``"1,5; 1-3"`` gives ``((1, 5), (1, 2, 3))``.

    A list has a set in each item, as ``[[1, 5], "1-3"]``, but a list of numbers is one set.
    """
    sets: Iterable[object] = [given]
    if isinstance(given, str):
        sets = given.split(";")
    elif isinstance(given, list | tuple):
        is_one_set = all(isinstance(stage, int) for stage in given)
        sets = [given] if is_one_set else given
    return distinct(parse_stages(stages) for stages in sets)


def parse_numbers(kind: str, given: object) -> Numbers:
    """Parse numbers and ranges, in a text separated by commas, such as ``0,3,5-9``."""
    return _union(_parse_ranges(kind, given, _NUMBERS_HINT))


def _parse_ranges(kind: str, given: object, hint: str) -> list[range]:
    """Return a range for each item of a typed list: ``"3,5-9"`` becomes 3 to 3 and 5 to 9.

    Args:
        kind: what the numbers are, for the error.
        given: as in `parse_names`.
        hint: what could be written instead, for the error.
    """
    ranges = []
    for part in parse_names(kind, given):
        found = _RANGE.fullmatch(part)
        numbers = range(0)  # empty, as is 9-5: both are refused
        if found is not None:
            last = found["last"] or found["first"]
            numbers = range(int(found["first"]), int(last) + 1)
        if not numbers:
            raise InvalidValueError(f"{_shorten(part)!r} is not a valid {kind}; {hint}.")
        ranges.append(numbers)
    return ranges


def _union(ranges: Sequence[range]) -> Numbers:
    """Return the numbers of all ranges, each once, in the order in which they were given."""
    count = sum(len(numbers) for numbers in ranges)
    if count > _MAX_NUMBERS:
        raise InvalidValueError(
            f"The list has {count:,} numbers; at most {_MAX_NUMBERS:,} are allowed."
        )
    return distinct(itertools.chain.from_iterable(ranges))


def _shorten(text: str) -> str:
    if len(text) <= _MAX_QUOTED_LENGTH:
        return text
    return f"{text[:_MAX_QUOTED_LENGTH]}…"
