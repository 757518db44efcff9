"""What a spec such as ``resolve:surface?policy=openpi://host:8000`` combines."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

from roboirg.core.errors import InvalidValueError
from roboirg.core.policy_ref import RESOLVE
from roboirg.policies.builtin import BUILTIN

POLICY = "policy"
WORDINGS = "wordings"
OPTIONS = (POLICY, WORDINGS)
"""Options of the rewriter; all others are the namer's."""


class Rewriting(NamedTuple):
    """A rewriter and the policy behind it, as they are named.

    Attributes:
        namer: what names the goals: ``surface``, ``vlm-listener:openai``.
        options: of the namer.
        policy: spec of the policy.
        wordings: whose explicit commands the policy hears: a wording file, ``train`` or ``test``;
            None for those of the run.
    """

    namer: str
    options: Mapping[str, str]
    policy: str
    wordings: str | None


def read_rewriting(spec: str, target: str, options: Mapping[str, str]) -> Rewriting:
    """Return what a spec ``resolve:NAMER?policy=SPEC&wordings=FILE`` combines.

    Args:
        spec: the whole, for messages.
        target: the namer.
        options: of the rewriter and of the namer, side by side.

    Raises:
        InvalidValueError: it names no policy, or one that does not listen to words.
    """
    of_namer = dict(options)
    policy = of_namer.pop(POLICY, "")
    wordings = of_namer.pop(WORDINGS, None)
    if not policy:
        raise InvalidValueError(
            f"Policy {spec!r} rewrites words, but names no policy that hears them; write "
            f"{RESOLVE}:{target or 'surface'}?{POLICY}=SPEC."
        )
    # Imported here because it brings the reader's patterns, which other policies do not need.
    from roboirg.shortcuts.surface_rules import SURFACE_RULES

    if policy in BUILTIN and policy not in SURFACE_RULES:
        raise InvalidValueError(
            f"Policy {spec!r}: {policy!r} does not listen to words, so rewriting them changes "
            "nothing; name a policy that does."
        )
    return Rewriting(target, of_namer, policy, wordings)
