"""Which episodes of a plan are longer than what the policies' language models read."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import NamedTuple

from roboirg.core.delivery import PromptVerdict, utterance_steps
from roboirg.core.errors import InvalidValueError
from roboirg.language.instruction import Instruction
from roboirg.policies.prompt_length.prompt_audit import (
    InstructionAudit,
    PromptLimit,
    audit_instruction,
)
from roboirg.policies.prompt_length.tokenizer_file import prompt_limit
from roboirg.records.record import Job, PromptAudit
from roboirg.runs.episode_errors import EpisodeError
from roboirg.runs.job_instruction import instruct_job

Verdicts = Counter[PromptVerdict]


class PromptShares(NamedTuple):
    """How many episodes of a policy are heard, cut or unknown.

    Attributes:
        policy: its name.
        limit: that it declares; None if it declares none.
        settings: verdicts by setting.
    """

    policy: str
    limit: PromptLimit | None
    settings: Mapping[str, Verdicts]


class AuditedPrompt(NamedTuple):
    """What of an instruction reaches a policy's model.

    Attributes:
        audit: in tokens, for the record.
        verdict: whether all of it does.
    """

    audit: PromptAudit
    verdict: PromptVerdict


def sent_messages(turns: Sequence[str], steps: Sequence[int | None]) -> tuple[tuple[str, ...], ...]:
    """Return the messages that a policy gets: utterances heard at one step are sent together.

    ``("a", "b", "c")`` heard at 0, 0 and 40 are the messages ``("a", "b")`` and ``("c",)``.

    Args:
        turns: texts of the utterances.
        steps: control step at which each was heard, ascending; None if it was not.
    """
    messages: dict[int, list[str]] = {}
    for text, step in zip(turns, steps, strict=True):
        if step is not None:
            messages.setdefault(step, []).append(text)
    return tuple(tuple(texts) for texts in messages.values())


def audit_prompt(
    instruction: Instruction, steps: Sequence[int | None], limit: PromptLimit
) -> AuditedPrompt:
    """Return how much of an instruction a policy's language model reads, given its token limit.

    Args:
        instruction: what is said.
        steps: control step at which each utterance is heard; None if it is not.
        limit: most tokens of a message, as the policy declares it.
    """
    found: InstructionAudit = audit_instruction(sent_messages(instruction.turns, steps), limit)
    mention_ends = [(mention.utterance, mention.end) for mention in instruction.mentions]
    audit = PromptAudit(
        limit=limit.tokens,
        needed=(found.least, found.most),
        tokenizer=limit.tokenizer,
        reached=found.reached,
        lost=found.lost(mention_ends),
    )
    return AuditedPrompt(audit, found.verdict)


def audit_job(
    job: Job, limit: PromptLimit, instruction: Instruction | None = None
) -> AuditedPrompt:
    """Return how much of a job's instruction a policy's language model will read.

    Args:
        job: what will be played; its delivery decides when each utterance is heard.
        limit: most tokens of a message, as the policy declares it.
        instruction: of the job; None makes it.
    """
    if instruction is None:
        instruction = instruct_job(job)
    steps = utterance_steps(len(instruction.utterances), job.options.delivery)
    return audit_prompt(instruction, steps, limit)


def check_prompt(job: Job, limit: PromptLimit, instruction: Instruction) -> None:
    """Refuse an instruction of which the policy's model does not read the end.

    Args:
        job: the episode.
        limit: of the policy.
        instruction: of the episode.

    Raises:
        EpisodeError: of the kind ``prompt``.
    """
    audited = audit_job(job, limit, instruction)
    if audited.verdict == "cut":
        words = (
            f"the instruction needs {audited.audit.needed_text} tokens, but the policy's model "
            f"reads {limit.tokens}; long_prompts: send in the plan plays the episode anyway"
        )
        raise EpisodeError("prompt", words, "")


def prompt_shares(jobs: Iterable[Job]) -> tuple[PromptShares, ...]:
    """Return for each policy how many prompts are longer than its language model reads, by setting.

    For example 3 ``cut``, 40 ``heard`` and 7 ``unknown`` in ``direct``. Policies and settings are
    in the order of the jobs.
    """
    limits: dict[str, PromptLimit | None] = {}
    counts: dict[str, dict[str, Verdicts]] = {}
    # An audit is slow, so its verdict is kept for policies with the same limit. The key is all that
    # it depends on: the limit, and what decides the words.
    audited: dict[tuple[object, ...], PromptVerdict] = {}
    for job in jobs:
        if job.policy not in limits:
            limits[job.policy] = _limit_of(job)
            counts[job.policy] = {}
        limit = limits[job.policy]
        verdict: PromptVerdict = "unknown"
        if limit is not None:
            key = (limit, job.task, job.split, job.episode, job.options, job.arm)
            if key not in audited:
                audited[key] = audit_job(job, limit).verdict
            verdict = audited[key]
        verdicts = counts[job.policy].setdefault(job.setting, Counter())
        verdicts[verdict] += 1
    return tuple(PromptShares(policy, limit, counts[policy]) for policy, limit in limits.items())


def _limit_of(job: Job) -> PromptLimit | None:
    """Return the limit that the policy of a job declares, as far as that is known now.

    Raises:
        InvalidValueError: the policy's tokenizer cannot be read; the message names the policy.
    """
    if job.ref is None or job.ref.needs is None:
        return None
    try:
        return prompt_limit(job.ref.needs)
    except InvalidValueError as error:
        raise InvalidValueError(f"The policy {job.policy} cannot be played: {error}") from error


def share_text(verdicts: Verdicts) -> str:
    """Return in percent how many prompts are too long: ``12 %``, or ``3–12 %`` if some may be."""
    total = verdicts.total()
    low = _percent(100 * verdicts["cut"] / total)
    high = _percent(100 * (verdicts["cut"] + verdicts["unknown"]) / total)
    return f"{low} %" if low == high else f"{low}–{high} %"


def warning_lines(shares: Iterable[PromptShares]) -> Iterator[str]:
    """Yield a sentence for each policy that does not read every instruction whole."""
    for share in shares:
        if share.limit is None:
            continue
        cut_settings = []
        for setting, verdicts in share.settings.items():
            if verdicts["cut"] or verdicts["unknown"]:
                cut_settings.append(f"{setting} {share_text(verdicts)}")
        if cut_settings:
            yield (
                f"{share.policy} reads {share.limit.tokens} tokens of a prompt: the end of these "
                f"instructions does not reach it: {', '.join(cut_settings)}."
            )


def _percent(share: float) -> str:
    """Return a percentage; a small one is ``<1`` and does not look like 0."""
    return "<1" if 0 < share < 1 else f"{share:.0f}"
