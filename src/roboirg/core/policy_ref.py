"""A policy as a run knows it: read once from its name, then handed on."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

from roboirg.core.field_types import Label, Name
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.versions import Makeup, Versions

BUILT_IN = "built-in"
"""Kind and version of policies that come with the package."""
UNKNOWN_VERSION = "unknown"
PRIVILEGED = "privileged:"
"""Before the spec of a policy of others: the user lets it read the simulator's state."""
HANDS = "hands"
"""Option of a planner: what follows its subgoals, a policy or one of the next two."""
RESOLVE = "resolve"
"""Kind of a policy behind a rewriter of what was said."""
BEHIND = "behind"
"""In the makeup of such a policy, the name of what hears the rewritten words."""
SCRIPTED = "scripted"
ELSEWHERE = "elsewhere"
"""Hands next to the world; and none, as a planner's own process has none."""

Place = Literal["world", "own", "split", "behind", "server", "python"]
"""Where a policy runs: in the simulator's process; in a process of its own; its planner in one and
its scripted hands in the simulator's; in one of its own, behind a rewriter in the simulator's; on a
server, whose client is in the simulator's process; or
in the Python process that made it, and so does the simulator."""

Asker = Literal["listener", "planner"]


@dataclass(frozen=True, slots=True, kw_only=True)
class PolicyRef:
    """A policy: what makes it, where it runs, and what is known of it before it plays.

    Attributes:
        name: in records and tables.
        spec: as it was named, with options.
        kind: what makes it: a kind of policies, a scheme of URLs, `BUILT_IN`, ``class`` or
            ``live``.
        target: what the kind makes: a class, file, address or name.
        options: of the kind.
        place: where it runs.
        is_foreign: whether its code is neither ours nor behind a protocol.
        is_privileged: whether it may read the simulator's state.
        asks: what of it asks a model, if that is ours.
        version: distinguishes it from an earlier policy of the same name.
        makeup: what it is besides its version, wherever it is; empty if only its name is known.
        problem: why it could not be opened, in words; its version is not known then.
        needs: what it declares, as far as that is known before it plays.
    """

    name: Label
    spec: str
    kind: str
    target: str
    options: tuple[tuple[str, str], ...] = ()
    place: Place = "world"
    is_foreign: bool = False
    is_privileged: bool = False
    asks: Asker | None = None
    version: Name = UNKNOWN_VERSION
    makeup: Makeup = ()
    problem: str | None = None
    needs: PolicyNeeds | None = None

    @property
    def text(self) -> str:
        """The policy as it is typed: its spec, with its name if it has one."""
        return self.spec if self.name == self.spec else f"{self.name}={self.spec}"

    @property
    def body(self) -> str:
        """The spec without the declaration that it is privileged."""
        return self.spec.removeprefix(PRIVILEGED)

    @property
    def is_declared(self) -> bool:
        """Whether the user declares it privileged."""
        return self.body != self.spec

    @property
    def versions(self) -> Versions:
        """Its version and what it is, for comparison with another one of its name."""
        return Versions(self.makeup, policy_version=self.version)

    @property
    def is_hosted(self) -> bool:
        """Whether it, its planner, or what is behind its rewriter has a process of its own."""
        return self.place in ("own", "split", "behind")

    @property
    def hosted_part(self) -> PolicyRef:
        """What runs in the process of its own: all of it, or its planner without hands.

        For a planner whose scripted hands are in the simulator's process, option `HANDS` becomes
        `ELSEWHERE`, so that the other process makes none.
        """
        if self.place != "split":
            return self
        options = {**dict(self.options), HANDS: ELSEWHERE}
        return replace(self, options=tuple(options.items()), place="own", is_privileged=False)


def unknown_policy(name: str) -> PolicyRef:
    """Return a policy of which nothing but its name is known."""
    return PolicyRef(name=name, spec=name, kind="unknown", target=name)
