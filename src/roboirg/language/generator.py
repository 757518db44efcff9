"""Generate the instruction of an episode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Unpack

from roboirg.core.delivery import DELIVERIES
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.field_types import check_whole
from roboirg.core.instruction_options import InstructionOptions, WordKeywords, as_fields
from roboirg.core.word_pools import outside_words
from roboirg.language.instruction import FORMS, Instruction, Mention, Utterance
from roboirg.language.landmarks import FRAMES
from roboirg.language.phrases import capitalized, mentions_in
from roboirg.language.phrases import words_of as phrase_text
from roboirg.language.request import (
    DISTRACTORS,
    MOST_DISTRACTORS,
    STAGE_SETS,
    InstructionRequest,
    InstructionSpec,
)
from roboirg.language.scenarios.identity import words_of
from roboirg.language.scenarios.spoken import refusal, say
from roboirg.language.scenarios.wording_store import find_wordings
from roboirg.language.settings import get_setting, settings_of
from roboirg.language.word_sampler import LANGUAGE_VERSION, sampler_of
from roboirg.tasks import get_task

_DEFAULT_METADATA: dict[str, object] = {
    "touched": [],
    "pattern": None,
    "patterns": [],
    "relation": None,
    "reference": None,
    "stages": [],
    "distractor": None,
    "distractors": 0,
    "landmarks": [],
    "landmark_classes": [],
    "frame": None,
    "rival": None,
    "rival_slot": None,
    "rival_position": None,
    "rival_reference": None,
    "candidates": {},
    "wordings": None,
    "command": "own",
}
"""The metadata that apply to some settings only."""


def instruct(
    episode: Episode,
    setting: str = "explicit",
    form: str = "implicit",
    **options: Unpack[WordKeywords],
) -> Instruction:
    """Return the instruction of an episode; the same arguments always give the same bytes.

    Args:
        episode: what to say.
        setting: name of a setting; `setting_names` lists them.
        form: ``implicit``, or ``resolved``, in which the command names the referents of its
            referring expressions. An explicit instruction is its own resolved form.
        **options: other fields of `InstructionOptions`; each changes only the settings that read
            it.

    Raises:
        UnknownNameError: a name does not exist.
        InvalidValueError: the task lacks the setting, the stages are none of `STAGE_SETS`, the
            number of distractors is below 1, the setting cannot express the episode, or the
            wordings are not open or have no words for it.
    """
    chosen = InstructionOptions(setting, form)
    return instruct_with(episode, replace(chosen, **as_fields(options)))


def instruct_with(episode: Episode, options: InstructionOptions, variant: int = 0) -> Instruction:
    """Return the instruction of an episode, as `instruct` does, with all options in one value.

    Args:
        episode: what to say.
        options: how to say it.
        variant: which of several choices of words to draw; 0 is the usual one.

    Raises:
        UnknownNameError: an option names what does not exist.
        InvalidValueError: the open wording file has no words of the task, or the setting cannot
            express the episode.
    """
    missing_words = _find_missing_words(episode, options)
    if missing_words is not None:
        raise InvalidValueError(f"The {missing_words}.")
    request = request_of(episode, options, variant)
    refusal_reason = refusal(request)
    if refusal_reason is not None:
        setting = options.setting
        raise InvalidValueError(
            f"The {setting} setting cannot express episode {episode.key} "
            f"(seed {episode.seed}): {refusal_reason}; leave {setting} out (--settings), or choose "
            "other episodes (--episodes)."
        )
    return spoken_instruction(request, say(request))


def find_refusal(episode: Episode, options: InstructionOptions) -> str | None:
    """Return why an episode cannot be said with some options; None if it can.

    ``no landmark singles out a target``: the end of a sentence, without a stop.

    Raises:
        InvalidValueError: the task lacks the setting, or an option is wrong.
    """
    missing = _find_missing_words(episode, options)
    return missing or refusal(request_of(episode, options))


def find_refusals(episode: Episode, **options: Unpack[WordKeywords]) -> Mapping[str, str]:
    """Return the settings of an episode's task that cannot express it, each with the reason.

    ``{"spatial": "no landmark singles out a target"}``.
    """
    usual = replace(InstructionOptions(), **as_fields(options))
    reasons = {}
    for name in settings_of(get_task(episode.task)):
        reason = find_refusal(episode, replace(usual, setting=name))
        if reason is not None:
            reasons[name] = reason
    return reasons


def expressible(episode: Episode, **options: Unpack[WordKeywords]) -> tuple[str, ...]:
    """Return the settings of an episode's task that can express it, explicit first."""
    refused = find_refusals(episode, **options)
    return tuple(name for name in settings_of(get_task(episode.task)) if name not in refused)


def request_of(
    episode: Episode, options: InstructionOptions, variant: int = 0
) -> InstructionRequest:
    """Return an episode with its task, checked options and the sampler that draws its words.

    `variant` selects other random words than the usual ones, 0.

    Raises:
        UnknownNameError: an option names what does not exist.
        InvalidValueError: an option is wrong, or the task lacks the setting.
    """
    check_options(options)
    task = get_task(episode.task)
    get_setting(options.setting, task)  # which the task must have
    return InstructionRequest(episode, task, options, sampler_of(episode, variant))


def _find_missing_words(episode: Episode, options: InstructionOptions) -> str | None:
    """Return why an open wording file has no words for an episode's task; None if it has some.

    None also if our own words are used. The text follows *The* in an error message.
    """
    wording_file = outside_words(options.wordings)
    if wording_file is None:
        return None
    tasks = find_wordings(wording_file).tasks
    if episode.task in tasks:
        return None
    return (
        f"wording file {wording_file} has no words of {episode.task}; name tasks that it has: "
        f"--tasks {','.join(tasks)}"
    )


def check_options(options: InstructionOptions) -> None:
    """Check that all options of an instruction have values that exist.

    Options that the chosen setting does not read are checked, too.

    Raises:
        UnknownNameError: a name does not exist.
        InvalidValueError: the stages or the number of distractors are wrong.
    """
    if options.stages not in STAGE_SETS:
        possible_sets = ", ".join(map(str, STAGE_SETS))
        raise InvalidValueError(f"The stages {options.stages} must be one of {possible_sets}.")
    check_whole("distractors", options.distractors, most=MOST_DISTRACTORS)
    check_names("form", [options.form], FORMS)
    check_names("distractor", [options.distractor], DISTRACTORS)
    check_names("frame", [options.frame], FRAMES)
    check_names("delivery", [options.delivery], DELIVERIES)


def spoken_instruction(request: InstructionRequest, spec: InstructionSpec) -> Instruction:
    """Return an instruction written out: phrases become texts, and their tagged words mentions.

    A phrase is pieces of text, some with tags: *Lift*, *it* (the color red). It becomes the text
    *Lift it* and a mention of its characters 5 to 7.

    Args:
        request: the episode, and how it is said.
        spec: the utterances as phrases, with their meaning.
    """
    utterances = []
    mentions: list[Mention] = []
    for index, (stage, phrase) in enumerate(spec.utterances):
        text = phrase_text(phrase)
        # Whole sentences of a wording file stay as their author wrote them.
        is_as_written = stage == "command" and "command" in spec.notes
        if not is_as_written:
            text = capitalized(text)
        utterances.append(Utterance(stage, text))
        mentions += mentions_in(phrase, index)
    return Instruction(
        task=request.task.name,
        episode=request.episode.key,
        setting=request.options.setting,
        form="resolved" if request.resolved else "implicit",
        utterances=tuple(utterances),
        mentions=tuple(mentions),
        metadata=_metadata(request, spec),
        meaning=spec.meaning,
    )


def _metadata(request: InstructionRequest, spec: InstructionSpec) -> dict[str, object]:
    """Return the metadata of an instruction, with the same keys for every setting.

    They are what its setting notes, such as the reasoning pattern, and how its words were drawn.
    Entries that the setting does not note keep their default.
    """
    options = request.options
    words_version = words_of(request.task.name, request.pool, options.setting, options.wordings)
    from_context = spec.meaning.terms.keys() - spec.meaning.settled
    return {
        **_DEFAULT_METADATA,
        **spec.notes,
        "wordings": options.wordings,
        "pool": request.pool,
        "words": words_version,
        "language_version": LANGUAGE_VERSION,
        "draws": list(request.sampler.log),
        # The values of the goal that the command leaves to its context.
        "hidden_slots": len(from_context),
    }
