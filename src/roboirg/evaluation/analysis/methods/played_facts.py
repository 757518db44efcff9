"""What the records of a run say about how each policy played, read once and one by one."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from roboirg.evaluation.policy_calls import SERVER
from roboirg.evaluation.records.record import Record

NOT_REPORTED = "not reported"

DECLARABLE = {
    "trained_on": "words it was trained on",
    "preprocessing": "preprocessing of observations, relative to training",
    "dtype": "number type of inference",
    "device": "device of inference",
    "libraries": "versions of libraries",
    "python": "Python",
    "text_normalization": "what it does to the text",
}
"""Keys of a policy's ``metadata`` that methods sections read, and what they stand for."""


@dataclass
class PlayedFacts:
    """What is known of one policy of a run.

    Attributes:
        needs: distinct values of what the policy declares that it needs, by name.
        declared: distinct values in its metadata, by key of `DECLARABLE`.
        inference: distinct values of what its process computes with, by field.
        is_remote: whether a server computes its actions.
        steps: control steps in all.
        calls: how often it was asked for actions.
        texts: by setting, the distinct instructions.
        attempts: records by the number of their attempt.
    """

    needs: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    declared: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    inference: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    is_remote: bool = False
    steps: int = 0
    calls: int = 0
    texts: dict[str, set[str]] = field(default_factory=lambda: defaultdict(set))
    attempts: Counter[int] = field(default_factory=Counter)

    def add(self, record: Record) -> None:
        """Take in one record."""
        metadata = record.policy_metadata
        for name, value in record.needs.items():
            self.needs[name].add(_words(value))
        for table in _tables(metadata):
            self.is_remote |= SERVER in table
            for key in DECLARABLE:
                if key in table:
                    self.declared[key].add(_words(table[key]))
        if record.inference is not None:
            found = record.inference
            self.inference["python"].add(found.python)
            self.inference["libraries"].add(_words(found.libraries))
            self.inference["dtypes"].add(_words(found.dtypes))
            self.inference["devices"].add(_words(found.devices))
        self.steps += record.steps
        self.calls += record.calls
        self.texts[record.setting].add(" ".join(one.text for one in record.instruction))
        self.attempts[record.attempt] += 1

    def need(self, name: str) -> str:
        """Return a declared need in words; in records from before needs were kept it is unknown."""
        if not self.needs:
            return NOT_REPORTED
        return "; ".join(sorted(one or "none" for one in self.needs.get(name, ("none",))))

    def said(self, key: str) -> str:
        """Return what the policy declares under a key of `DECLARABLE`."""
        return _listed(self.declared.get(key, ()))

    def measured(self, name: str) -> str:
        """Return what the policy's process reported; a server's process was not asked."""
        return NOT_REPORTED if self.is_remote else _listed(self.inference.get(name, ()))


def read_facts(records: Iterable[Record]) -> Mapping[str, PlayedFacts]:
    """Return what records say, by policy in the order of their first record."""
    found: dict[str, PlayedFacts] = {}
    for record in records:
        found.setdefault(record.policy, PlayedFacts()).add(record)
    return found


def _tables(metadata: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Yield a policy's metadata, and those of the policy behind a planner."""
    yield metadata
    behind = metadata.get("policy")
    if isinstance(behind, Mapping):
        yield behind


def _listed(values: Iterable[str]) -> str:
    found = sorted(one for one in values if one)
    return "; ".join(found) or NOT_REPORTED


def _words(value: object) -> str:
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {one}" for key, one in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(str, value))
    if isinstance(value, bool):
        return "yes" if value else "no"
    return str(value)
