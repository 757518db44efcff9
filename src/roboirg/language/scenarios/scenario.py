"""The content of the data files: scenarios, the commands of a task, pointers, and what all share.

`docs/add-scenario.md` explains the fields to authors.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any, Literal, get_args

import msgspec

from roboirg.core.episode import Goal
from roboirg.core.word_pools import PoolName
from roboirg.language.scenarios.markup import Operation, Text

PatternName = Literal[
    "color exclusion", "number deduction", "sequential relation", "contextual logic"
]
PATTERNS: tuple[PatternName, ...] = get_args(PatternName)
"""How the goal of a reasoning scenario can follow."""
Texts = tuple[str, ...]
Sentences = Mapping[str, tuple[Text, ...]]
"""By field: one sentence, parsed, or several of which any can be said."""
PERSON = ("person", "he", "him", "his", "hers")
"""The slots of a person, ``hers`` for *his* or *hers* alone; those of another one end in ``.2``."""
PEOPLE = frozenset(f"{slot}{number}" for number in ("", ".2") for slot in PERSON)
"""Those of both."""
COMMANDS = "commands"
"""Among the parts of words that a file has itself."""
REMARKS = ("remarks.former", "remarks.latter", "remarks.not_former", "remarks.not_latter")
"""The remarks of direct-rival, by what they point at, and whether they set that aside."""


class PointerRow(msgspec.Struct, frozen=True, forbid_unknown_fields=True, rename={"kind": "class"}):
    """An expression of the closed table; `pointers.toml` explains the fields."""

    words: str
    kind: str
    of: tuple[str, ...]
    operation: Operation
    resolved: str = ""
    quote: str = ""


class Derive(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How the goal of a reasoning scenario follows: pattern, and the relations that it can say."""

    pattern: PatternName
    relations: Texts = ()


class Needs(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What must hold of an episode; nothing about the values of its goal, which it would give away.

    Attributes:
        colors: possible numbers of colors in the goal.
        shown: possible numbers of colors in the scene that a goal can ask for.
        list: possible lengths of the list.
        tasks: in which its sentences are true; empty for all tasks of its file.
    """

    colors: tuple[int, ...] = ()
    shown: tuple[int, ...] = ()
    list: tuple[int, ...] = ()
    tasks: Texts = ()


People = Mapping[Literal["he", "she"], Texts]
"""Who can be spoken of, by pronoun."""


class ScenarioFields(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What a scenario's file has besides sentences.

    `pool` is None for both, in the files of users only.
    """

    frame: str
    pool: PoolName | None
    setting: str
    list: str = ""
    derive: Derive | None = None
    needs: Needs = Needs()
    people: People | None = None

    def is_in(self, pool: PoolName) -> bool:
        """Return whether a pool has the scenario."""
        return self.pool in (None, pool)


class Scenario(msgspec.Struct, frozen=True):
    """A scenario with its sentences parsed.

    Attributes:
        fields: the others, as written.
        texts: its sentences by field, ``say.color`` has several.
        people: who can be spoken of, each with his or her pronouns; empty if nobody is.
        said: the fields of the command that point back.
    """

    fields: ScenarioFields
    texts: Sentences
    people: tuple[Texts, ...]
    said: Texts

    def text(self, field: str) -> Text:
        """Return the only sentence of a field; empty if it has none."""
        return self.texts.get(field, ((),))[0]


class General(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the scenarios of all tasks share: people, and remarks about anything."""

    people: People
    distractors: Mapping[PoolName, Texts]


class FileFields(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A file, with its scenarios as they were written.

    Attributes:
        tasks: that it serves.
        name: of a user's words, for records; empty for ours.
        source: of a user's words, in a sentence.
        scenario: the table of each scenario.
        commands: of a task, or of `ALL`, by pool; a list is for both pools.
        stated: words by field, of a task or of `ALL`.
        literal: the table of each whole sentence.
    """

    tasks: Texts = ()
    name: str = ""
    source: str = ""
    scenario: tuple[dict[str, Any], ...] = ()
    commands: Mapping[str, Mapping[PoolName, Texts] | Texts] = {}
    stated: Mapping[str, Mapping[str, str]] = {}
    literal: tuple[dict[str, Any], ...] = ()


class TaskScenarios(msgspec.Struct, frozen=True):
    """The words of a task.

    Attributes:
        commands: skeletons, of any fields that a goal can have, by pool.
        stated: the words that state a field's value.
        scenarios: all that are said of it.
        file: the name of the file that has them.
        literals: whole sentences, which explicit says instead of a command.
        own: what the file has itself: fields of `stated`, and `COMMANDS`. The rest is of the file
            that the task names.
    """

    commands: Mapping[PoolName, Texts]
    stated: Mapping[str, Text]
    scenarios: list[Scenario]
    file: str
    literals: Mapping[Goal, str] = {}
    own: Collection[str] = ()
