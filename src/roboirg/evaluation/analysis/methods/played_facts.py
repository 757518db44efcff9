"""What the records of a run say about how each policy played, read once and one by one."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

from roboirg.core.arms import SILENT_TEXTS
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS
from roboirg.evaluation.analysis.stats.option_labels import options_label
from roboirg.evaluation.policy_calls import SERVER
from roboirg.evaluation.records.record import Record

NOT_REPORTED = "not reported"
NOT_RECORDED = f"{NOT_REPORTED} in these records"
NO_NETWORK = "not applicable, as there is no neural network"

DECLARABLE = {
    "network": "network",
    "policy": "name of the policy served",
    "version": "version of the policy",
    "chunk": "length of a chunk, as declared",
    "execute": "actions returned of each chunk",
    "dtype": "number type of the computation",
    "parameter_dtype": "number type of the parameters",
    "device": "device of inference",
    "libraries": "versions of libraries that its process had loaded (of any other: not reported)",
    "python": "version of Python",
    "preprocessing": "preprocessing, relative to training, as declared",
    "reads_text": "understands the text",
    "text_normalization": "what it does to the text",
    "trained_on": "words of the benchmark that it was trained on, or written for",
}
"""Keys of a policy's ``metadata`` that methods sections read, and what they stand for."""

_OF_NETWORKS = ("dtype", "parameter_dtype", "preprocessing", "text_normalization")
"""Those that do not exist without a network."""

FIXED = "fixed"
"""Instead of a pool: a text that is the same in every scene."""

Items = Iterator[tuple[str, str]]
"""What an item is about, and what is known of it."""


class TextColumn(NamedTuple):
    """Instructions that are counted together."""

    options: InstructionOptions
    arm: str

    @property
    def label(self) -> str:
        """Setting and arm in words."""
        return f"{options_label(self.options)}, arm {self.arm}"


@dataclass
class SaidTexts:
    """The distinct texts of a column.

    Attributes:
        texts: each with the pool of its words, or `FIXED`; None for words from elsewhere.
        commands: the templates of their commands, with the task.
        choices: what was drawn for the other words.
    """

    texts: set[tuple[str, str | None]] = field(default_factory=set)
    commands: set[tuple[str, str]] = field(default_factory=set)
    choices: set[str] = field(default_factory=set)

    def add(self, record: Record) -> None:
        metadata = record.metadata
        is_ours = metadata.get("wordings") in (None, *POOLS) and record.arm not in SILENT_TEXTS
        text = " ".join(one.text for one in record.instruction)
        elsewhere = FIXED if record.arm in SILENT_TEXTS else None
        self.texts.add((text, metadata.get("pool") if is_ours else elsewhere))
        drawn = set(metadata.get("templates", ()) if is_ours else ())
        commands = {one for one in drawn if one.startswith("command-")}
        self.commands |= {(record.task, one) for one in commands}
        self.choices |= drawn - commands


@dataclass
class PlayedFacts:
    """What is known of one policy of a run.

    Attributes:
        needs: distinct values of what the policy declares that it needs, or the run prescribes.
        declared: distinct values in its metadata, by key of `DECLARABLE`.
        inference: distinct values of what its process computes with, by key of `DECLARABLE`.
        scheme: of its URL; empty if it has none.
        is_remote: whether a server computes its actions.
        is_privileged: whether it reads the simulator's state.
        steps: control steps in all.
        calls: how often it was asked for actions.
        verdicts: rollouts by whether all that was said reached its language model.
        repeated: rollouts that were begun more than once.
    """

    needs: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    declared: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    inference: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    scheme: str = ""
    is_remote: bool = False
    is_privileged: bool = False
    steps: int = 0
    calls: int = 0
    verdicts: Counter[str] = field(default_factory=Counter)
    repeated: int = 0

    def add(self, record: Record) -> None:
        for name, value in record.needs.items():
            self.needs[name].add(_words(value))
        self.scheme = record.policy_spec.partition("://")[0] if "://" in record.policy_spec else ""
        for table in _tables(record.policy_metadata):
            self.is_remote |= SERVER in table
            for key in DECLARABLE.keys() & table.keys():
                self.declared[key].add(_words(table[key]))
        self.declared["version"] = {*self.declared["version"], record.policy_version} - {"unknown"}
        if (found := record.inference) is not None:
            keys = "python", "libraries", "parameter_dtype", "device"
            values = found.python, found.libraries, found.dtypes, found.devices
            for key, one in zip(keys, values, strict=True):
                self.inference[key].add(_words(one))
        self.is_privileged |= record.privileged
        self.steps += record.steps
        self.calls += record.calls
        self.verdicts[record.prompt_verdict] += 1
        self.repeated += record.attempt > 1

    def need(self, name: str) -> str:
        """Return a need in words; in records from before needs were kept it is unknown."""
        found = self.needs.get(name, {""}) if self.needs else ()
        return _listed(one or "none" for one in found) or NOT_RECORDED

    def know(self, key: str) -> str:
        """Return what is known under a key of `DECLARABLE`.

        That is what the policy or its server declares, or else what its process reported; the
        process of a server was not asked.
        """
        measured = () if self.is_remote else self.inference.get(key, ())
        known = _listed(self.declared.get(key, ())) or _listed(measured)
        if not known and key in _OF_NETWORKS and self.declared["network"] == {"none"}:
            return NO_NETWORK
        return known or f"{NOT_REPORTED} by the {'server' if self.is_remote else 'policy'}"

    def labeled(self, key: str) -> str:
        """Return the same after what the key stands for."""
        return f"{DECLARABLE[key]}: {self.know(key)}"


def distinct(values: Iterable[object]) -> str:
    """Return the distinct values in order, without None."""
    found = sorted({str(one) for one in values if one is not None})
    return ", ".join(found) or NOT_RECORDED


def item(label: str, *parts: str) -> tuple[str, str]:
    """Return an item of several parts."""
    return label, "; ".join(parts)


def read_facts(
    records: Iterable[Record],
) -> tuple[Mapping[str, PlayedFacts], Mapping[TextColumn, SaidTexts]]:
    """Return how each policy played, in the order of their first records, and what was said."""
    played: dict[str, PlayedFacts] = {}
    said: defaultdict[TextColumn, SaidTexts] = defaultdict(SaidTexts)
    for record in records:
        played.setdefault(record.policy, PlayedFacts()).add(record)
        said[TextColumn(record.column, record.arm)].add(record)
    return played, said


def _tables(metadata: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield a policy's metadata, and those of the policy behind a planner.

    What a planner has for a network is not known from the policy behind it.
    """
    own = dict(metadata)
    if isinstance(behind := own.get("policy"), Mapping):
        del own["policy"]
        yield {key: value for key, value in behind.items() if key != "network"}
    yield own


def _listed(values: Iterable[str]) -> str:
    return "; ".join(sorted(one for one in values if one))


def _words(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {one}" for key, one in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)
