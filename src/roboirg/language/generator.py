"""Generate the instruction of an episode."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Unpack

from roboirg.core.delivery import DELIVERIES
from roboirg.core.episode import Episode
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.field_types import check_whole
from roboirg.core.instruction_options import (
    DEFAULT_FRAME,
    DEFAULT_LANGUAGE,
    InstructionOptions,
    WordKeywords,
    as_fields,
)
from roboirg.core.word_pools import outside_words
from roboirg.language.instruction import FORMS, Instruction, Mention, Utterance, hidden_slots
from roboirg.language.landmarks import FRAMES
from roboirg.language.phrases import speak
from roboirg.language.request import (
    DISTRACTORS,
    MOST_DISTRACTORS,
    STAGE_SETS,
    InstructionRequest,
    InstructionSpec,
)
from roboirg.language.scenarios import in_language_4
from roboirg.language.scenarios.identity import words_of
from roboirg.language.scenarios.literals import in_literals
from roboirg.language.scenarios.wording_store import find_wordings
from roboirg.language.settings import EXPLICIT, all_settings, get_setting, settings_of
from roboirg.language.settings.setting import Setting
from roboirg.language.template_sampler import sampler_of
from roboirg.language.templates import LANGUAGE_VERSIONS
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
    "recency_rival": None,
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
    "template_slots": [],
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
    """Return the instruction of an episode; like `instruct`, with all options in one value.

    Each `variant` draws its words anew; 0 is the usual one.
    """
    setting = _setting_of(episode, options)
    missing = _missing(episode, options)
    if missing is not None:
        raise InvalidValueError(f"The {missing}.")
    reason = setting.refusal(request_of(episode, options, variant))
    if reason is not None:
        raise InvalidValueError(
            f"The {setting.name} setting cannot express episode {episode.key} "
            f"(seed {episode.seed}): {reason}; leave {setting.name} out (--settings), or choose "
            "other episodes (--episodes)."
        )
    request = request_of(episode, options, variant)  # without what the refusal noted in its log
    return spoken_instruction(request, setting.say(request))


def find_refusal(episode: Episode, options: InstructionOptions) -> str | None:
    """Return why a setting of the task cannot express an episode; None if it can."""
    setting = _setting_of(episode, options)
    request = request_of(episode, options)
    return _missing(episode, options) or setting.refusal(request)


def find_refusals(
    episode: Episode, *, frame: str = DEFAULT_FRAME, wordings: str | None = None
) -> Mapping[str, str]:
    """Return the settings of the task that cannot express an episode, each with the reason."""
    reasons = {
        name: find_refusal(episode, InstructionOptions(name, frame=frame, wordings=wordings))
        for name in settings_of(get_task(episode.task))
    }
    return {name: reason for name, reason in reasons.items() if reason is not None}


def expressible(
    episode: Episode, *, frame: str = DEFAULT_FRAME, wordings: str | None = None
) -> tuple[str, ...]:
    """Return the settings of the task that can express an episode."""
    refused = find_refusals(episode, frame=frame, wordings=wordings)
    return tuple(name for name in settings_of(get_task(episode.task)) if name not in refused)


def request_of(
    episode: Episode, options: InstructionOptions, variant: int = 0
) -> InstructionRequest:
    """Return the request to put an episode into words."""
    check_options(options)
    task, setting = get_task(episode.task), all_settings()[options.setting]
    if "language" not in setting.reads:  # its words are the same in each
        options = replace(options, language=DEFAULT_LANGUAGE)
    sampler = sampler_of(episode, variant, options.language)
    return InstructionRequest(episode, task, options, sampler)


def _setting_of(episode: Episode, options: InstructionOptions) -> Setting:
    """Return the setting that speaks the words that are asked for."""
    setting = get_setting(options.setting, get_task(episode.task))
    identity = outside_words(options.wordings)
    if identity is not None and setting.name == EXPLICIT:
        theirs = find_wordings(identity).tasks.get(episode.task)
        if theirs is not None and theirs.literals:
            return in_literals(theirs.literals, f"the wording file {identity}")
    return setting if options.language == DEFAULT_LANGUAGE else in_language_4(setting)


def _missing(episode: Episode, options: InstructionOptions) -> str | None:
    """Return why a wording file cannot serve a task; None if it can, or words are our own."""
    identity = outside_words(options.wordings)
    if identity is None:
        return None
    wordings = find_wordings(identity)
    if episode.task not in wordings.tasks:
        return f"wording file {identity} has no words of {episode.task}"
    if wordings.needs_language_4 and options.language == DEFAULT_LANGUAGE:
        return (
            f"wording file {identity} has commands or scenarios, which need language 4 (--language "
            "4, or language: 4 in the plan)"
        )
    return None


def check_options(options: InstructionOptions) -> None:
    """Check all options of an instruction, those that its setting does not read included."""
    if options.stages not in STAGE_SETS:
        sets = ", ".join(str(one) for one in STAGE_SETS)
        raise InvalidValueError(f"The stages {options.stages} must be one of {sets}.")
    check_whole("distractors", options.distractors, most=MOST_DISTRACTORS)
    if options.language not in LANGUAGE_VERSIONS:
        known_ones = " or ".join(map(str, LANGUAGE_VERSIONS))
        raise InvalidValueError(f"language is {options.language!r}; it must be {known_ones}.")
    for kind, name, known in (
        ("form", options.form, FORMS),
        ("distractor", options.distractor, DISTRACTORS),
        ("frame", options.frame, FRAMES),
        ("delivery", options.delivery, DELIVERIES),
    ):
        check_names(kind, [name], known)


def spoken_instruction(request: InstructionRequest, spec: InstructionSpec) -> Instruction:
    """Return the instruction that has the words of a request."""
    options = request.options
    utterances, mentions = _spoken(spec, as_written="command" in spec.notes)
    notes: dict[str, object] = {"wordings": options.wordings, "pool": request.pool}
    words = words_of(
        request.task.name, request.pool, options.language, options.setting, options.wordings
    )
    if words:
        notes["words"] = words
    found = Instruction(
        task=request.task.name,
        episode=request.episode.key,
        setting=options.setting,
        form="resolved" if request.resolved else "implicit",
        utterances=utterances,
        mentions=mentions,
        metadata={
            **_DEFAULT_METADATA,
            **spec.notes,
            **notes,
            "language_version": LANGUAGE_VERSIONS[options.language],
            "templates": list(request.sampler.log),
        },
        meaning=spec.meaning,
    )
    hidden = _hidden_slots(request, found)
    return replace(found, metadata={**found.metadata, "hidden_slots": hidden})


def _hidden_slots(request: InstructionRequest, instruction: Instruction) -> int:
    """Return how many values of the goal the command leaves to its context."""
    if instruction.meaning is not None:
        return len(instruction.meaning.terms.keys() - instruction.meaning.settled)
    if request.resolved:
        return 0
    hidden = hidden_slots(instruction, request.episode.goal)
    return sum(value.slot in hidden for value in request.goal_values)


def _spoken(
    spec: InstructionSpec, *, as_written: bool
) -> tuple[tuple[Utterance, ...], tuple[Mention, ...]]:
    utterances: list[Utterance] = []
    mentions: list[Mention] = []
    for index, (stage, phrase) in enumerate(spec.utterances):
        capitalize = stage != "command" or not as_written
        utterance, found = speak(index, stage, phrase, capitalize=capitalize)
        utterances.append(utterance)
        mentions += found
    return tuple(utterances), tuple(mentions)
