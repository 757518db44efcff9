"""What a result depends on and a later one may not share, and in what two results differ."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

Makeup = tuple[tuple[str, str], ...]
"""What a policy is, besides its version: what makes it, under `POLICY`, then the options that
change what it sees or does, in one spelling each and without those that have their defaults."""

POLICY = "policy"
DEFAULT = "the default"
"""Value of an option that is left out."""
NO_VERSION = "none"
"""Of a server that reported none, and without a server."""


class Mismatch(NamedTuple):
    """A version, an option, or the policy itself, that two do not share, with the value of each."""

    what: str
    first: str
    second: str


class Versions(NamedTuple):
    """The versions that a result depends on; None for what is not known or not to be compared.

    Attributes:
        policy: the version of the policy.
        language: the version of the words.
        environment: the version of scenes, rules and physics.
        server: the version that the policy's server reported, or `NO_VERSION`.
        makeup: what the policy is; None in older records.
        typed: the same as far as its name shows it, for comparison with older records.
        package: the version of roboirg.
    """

    policy: str | None = None
    language: str | None = None
    environment: int | None = None
    server: str | None = None
    makeup: Makeup | None = None
    typed: Makeup | None = None
    package: str | None = None

    @property
    def known_makeup(self) -> Makeup:
        """What the policy is, as far as it is known."""
        return self.makeup or self.typed or ()

    @property
    def of_policy(self) -> Versions:
        """Those of the policy and its server alone, which words and scenes do not change."""
        return self._replace(language=None, environment=None)

    def differences(self, other: Versions) -> list[Mismatch]:
        """Return all in which two differ: what the policy is first, then versions."""
        mine, theirs = self.makeup, other.makeup
        if mine is None or theirs is None:
            mine, theirs = self.typed, other.typed
        found: list[Mismatch] = []
        if mine is not None and theirs is not None:
            first, second = dict(mine), dict(theirs)
            for name in differing_names([mine, theirs]):
                values = first.get(name, DEFAULT), second.get(name, DEFAULT)
                what = name if name == POLICY else f"option {name}"
                found.append(Mismatch(what, *values))
        for name in ("environment", "language", "policy", "server", "package"):
            here, there = getattr(self, name), getattr(other, name)
            if here != there and here is not None and there is not None:
                found.append(Mismatch(f"{name} version", str(here), str(there)))
        return found


def differing_names(makeups: Collection[Makeup]) -> list[str]:
    """Return the options in which policies differ; only `POLICY` if they are not of one make."""
    known = [dict(makeup) for makeup in makeups]
    names: set[str] = set()
    for makeup in known:
        names |= makeup.keys()
    found = [name for name in sorted(names) if len({makeup.get(name) for makeup in known}) > 1]
    return [POLICY] if POLICY in found else found
