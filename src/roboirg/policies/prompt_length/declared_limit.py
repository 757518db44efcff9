"""The limit of a prompt that a policy declares."""

from __future__ import annotations

from pathlib import Path

from roboirg.policies.contract.policy_needs import PolicyNeeds
from roboirg.policies.prompt_length.prompt_audit import PromptLimit
from roboirg.policies.prompt_length.tokenizer_file import read_tokenizer


def prompt_limit(needs: PolicyNeeds) -> PromptLimit | None:
    """Return the limit that a policy declares; None if it declares none."""
    if needs.prompt_tokens is None:
        return None
    path = needs.tokenizer
    return PromptLimit(
        needs.prompt_tokens,
        needs.prompt_added,
        None if path is None else read_tokenizer(path),
        None if path is None else Path(path).name,
        needs.lowers_prompt,
    )
