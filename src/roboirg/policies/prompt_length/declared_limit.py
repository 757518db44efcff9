"""The limit of a prompt that a policy declares."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from roboirg.policies.by_name.loading import load_policy_class
from roboirg.policies.contract.policy_urls import is_url
from roboirg.policies.contract.requirements import (
    wanted_lower_case,
    wanted_prompt_added,
    wanted_prompt_tokens,
    wanted_tokenizer,
)
from roboirg.policies.prompt_length.prompt_audit import PromptLimit
from roboirg.policies.prompt_length.tokenizer_file import read_tokenizer


class PromptNeeds(NamedTuple):
    """What a policy declares about its prompt, each under the name of the policy's attribute."""

    prompt_tokens: int | None = None
    prompt_added: int = 0
    tokenizer: str | None = None
    lowers_prompt: bool = False


def prompt_needs(policy: object) -> PromptNeeds:
    """Return what a policy, or a class of policies, declares; no file is read.

    Raises:
        InvalidValueError: an attribute has an invalid value.
    """
    return PromptNeeds(
        wanted_prompt_tokens(policy),
        wanted_prompt_added(policy),
        wanted_tokenizer(policy),
        wanted_lower_case(policy),
    )


def prompt_needs_of(spec: str) -> PromptNeeds:
    """Return what the policy of a spec declares; it is not connected to anything.

    Raises:
        InvalidValueError: there is no such policy, or its declaration is invalid.
        MissingDependencyError: a library that it needs is not installed.
    """
    policy_class = load_policy_class(spec)
    return prompt_needs(policy_class(spec) if is_url(spec) else policy_class)


def prompt_limit(policy: object) -> PromptLimit | None:
    """Return the limit of a policy, or of what it declares; None if it declares none.

    Raises:
        InvalidValueError: an attribute has an invalid value, or the tokenizer's file holds none.
        MissingDependencyError: the library that reads that file is not installed.
    """
    needs = prompt_needs(policy)
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
