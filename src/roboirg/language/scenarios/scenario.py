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
    """A row of the table of pointers, words that point back; `pointers.toml` explains the fields.

    The row for *the latter*: ``words = "the latter"``, ``class = "latter"``, ``operation =
    "rank"``.
    """

    words: str
    kind: str
    of: tuple[str, ...]
    operation: Operation
    resolved: str = ""
    quote: str = ""


class Derive(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """How the goal of a reasoning scenario follows.

    Attributes:
        pattern: the kind of reasoning.
        relations: those that its words can say, ``one fewer``; empty if nothing is computed.
    """

    pattern: PatternName
    relations: Texts = ()


class Needs(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What must hold of an episode in which a scenario is said.

    Nothing is about the values of its goal: a scenario for red goals only would give them away.

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
    """What a scenario's file has besides sentences. Digests depend on the names of these fields.

    Attributes:
        frame: the name of the scenario, for its situation: ``school trip``.
        pool: ``train`` or ``test``; None for both, in the files of users only.
        setting: in which it is said.
        list: the slot of the goal of which it lists values, *red or blue*; empty if it does not.
        derive: how the goal follows; in reasoning only.
        needs: what must hold of an episode.
        people: whose names it can say; None for those of `general.toml`.
    """

    frame: str
    pool: PoolName | None
    setting: str
    list: str = ""
    derive: Derive | None = None
    needs: Needs = Needs()
    people: People | None = None

    def is_in(self, pool: PoolName) -> bool:
        """Return whether a pool, ``train`` or ``test``, has the scenario."""
        return self.pool in (None, pool)


class Scenario(msgspec.Struct, frozen=True):
    """A scenario: a template for a text, with its sentences parsed.

    Attributes:
        fields: all that is no sentence, as written.
        texts: its sentences by field; ``say.color`` may have several, of which one is drawn.
        people: of whom it can speak, each a name with his or her pronouns; empty if it names
            no people.
        said: the fields of the command for which it has words that point back: ``("color",)``.
    """

    fields: ScenarioFields
    texts: Sentences
    people: tuple[Texts, ...]
    said: Texts

    def text(self, field: str) -> Text:
        """Return the first sentence of a field, parsed; empty if it has none."""
        return self.texts.get(field, ((),))[0]


class General(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What the scenarios of all tasks share: people, and remarks about anything."""

    people: People
    distractors: Mapping[PoolName, Texts]


class FileFields(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The content of a file of words, with its tables as they were written.

    Attributes:
        tasks: that it serves.
        name: of a user's words, for records; empty for ours.
        source: of a user's words, in a sentence.
        scenario: the table of each scenario.
        commands: of a task, or of `ALL`, by pool; a list is for both pools.
        stated: by task, or of `ALL`, the words that state the value of each field.
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
    """The words of a task: all from which its instructions are made.

    Attributes:
        commands: by pool, with slots for the fields of a goal: ``Pick up {color} {repeats}.``
        stated: the words that state the value of a field: ``the {color} cube``.
        scenarios: all that are said of it, in all settings.
        file: the name of the file that has them.
        literals: whole sentences by goal, which explicit says instead of a command.
        own: what the file has itself: fields of `stated`, and `COMMANDS`. The rest is of the file
            that the task names.
    """

    commands: Mapping[PoolName, Texts]
    stated: Mapping[str, Text]
    scenarios: list[Scenario]
    file: str
    literals: Mapping[Goal, str] = {}
    own: Collection[str] = ()
