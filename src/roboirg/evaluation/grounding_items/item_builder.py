"""Make the items of one episode: every wanted instruction, with its questions and answers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, astuple, replace
from typing import Any, cast

from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.word_pools import POOLS, pool_of
from roboirg.evaluation.grounding_items.goal_choices import draw_choices
from roboirg.evaluation.grounding_items.grounding_item import LETTERS, GroundingItem
from roboirg.evaluation.grounding_items.media_store import EpisodeMedia
from roboirg.evaluation.grounding_items.referents import is_ordered, noun, pointed_kinds
from roboirg.language import instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.instruction import command_expressions
from roboirg.language.scenarios.identity import language_label
from roboirg.language.settings import all_settings, settings_of
from roboirg.language.templates import LANGUAGE_VERSIONS
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.policies.vlm.listener_query import PROMPTS, question_texts
from roboirg.policies.vlm.prompt_files import Prompts, load_prompts
from roboirg.shortcuts.command_chance import blind_goals, is_right, right_share
from roboirg.shortcuts.shortcut_scores import hidden_slots
from roboirg.tasks import get_task, with_goal

QUESTIONS = "grounding_questions"
"""Name of the prompts for the questions that the listener does not ask."""
SIZE = 256
ID_DIGITS = 16


def wanted_options(
    episode: Episode,
    settings: Sequence[str],
    forms: Sequence[str],
    options: InstructionOptions,
    *,
    every_variant: bool,
) -> Iterator[InstructionOptions]:
    """Yield the options of an episode's items; equal words once.

    Leaves out settings that the task lacks or that cannot express the episode. An option that a
    setting does not read keeps its default.

    Args:
        episode: the episode.
        settings: names of settings.
        forms: implicit, resolved or both; explicit has one form.
        options: all others.
        every_variant: add every combination of options that changes the words of a setting.
    """
    present = settings_of(get_task(episode.task))
    for name in (name for name in settings if name in present):
        setting = all_settings()[name]
        usual = InstructionOptions(name, wordings=options.wordings)
        chosen: dict[str, Any] = {
            str(one): getattr(options, one) for one in setting.reads - {"delivery"}
        }
        variants: list[Mapping[str, Any]] = [chosen]
        if every_variant:
            variants += setting.variants
        found = [
            replace(usual, form=form, **changes)
            for changes in variants
            for form in (forms if setting.implicit else (usual.form,))
        ]
        yield from (one for one in dict.fromkeys(found) if find_refusal(episode, one) is None)


def make_items(
    episode: Episode, media: EpisodeMedia, wanted: Sequence[InstructionOptions]
) -> list[GroundingItem]:
    listener, questions = load_prompts(PROMPTS), load_prompts(QUESTIONS)
    return [_make_item(episode, media, options, listener, questions) for options in wanted]


def item_id(episode: Episode, options: InstructionOptions) -> str:
    """Return the name of an item. It is a hash, which gives nothing away about the answer."""
    *words, language = astuple(options)
    pool = pool_of(episode.split, options.wordings)
    content = (
        episode.key,
        *words,
        language_label([episode.task], pool, language, [options.setting], options.wordings),
        ENVIRONMENT_VERSION,
    )
    return "g" + hashlib.sha256(repr(content).encode()).hexdigest()[:ID_DIGITS]


def _make_item(
    episode: Episode,
    media: EpisodeMedia,
    options: InstructionOptions,
    listener: Prompts,
    questions: Prompts,
) -> GroundingItem:
    task, instruction = get_task(episode.task), instruct_with(episode, options)
    schema, name = goal_schema(episode.task), item_id(episode, options)
    texts = question_texts(listener, schema, instruction.text, media.steps)
    choices, right = draw_choices(episode, instruction, name)
    pool = next(one for one in POOLS if one != instruction.metadata["pool"])
    explicit = InstructionOptions(wordings=pool, language=options.language)
    commands = [instruct_with(with_goal(episode, goal), explicit).text for goal in choices]
    goals, answers = task.goals(episode.scene), schema.answers
    chance = right_share(blind_goals(instruction, episode), episode)
    return GroundingItem(
        id=name,
        task=task.name,
        suite=task.suite,
        split=episode.split,
        episode=episode.index,
        difficulty=episode.difficulty,
        **_option_fields(options),
        text=instruction.text,
        turns=list(instruction.turns),
        picture=media.picture,
        video=media.video,
        video_steps=media.steps,
        frames=list(media.frames),
        slots_system=texts.system,
        system=questions.fill("system"),
        said=texts.instruction,
        shown=texts.video,
        now=texts.now,
        slots_question=texts.question,
        choice_question=_choice_question(questions, commands),
        points_question=_points_question(questions, episode),
        schema=json.dumps(schema.schema(), separators=(",", ":")),
        choices=commands,
        answer=answers[episode.goal],
        answers=[answers[goal] for goal in goals if is_right(goal, episode)],
        goals=[answers[goal] for goal in goals],
        choice=LETTERS[right],
        choice_answers=[answers[goal] for goal in choices],
        points=list(media.points),
        points_in_order=is_ordered(episode.goal),
        command_chance=None if chance is None else float(chance),
        # A resolved command leaves none to its context.
        hidden_slots=[]
        if options.form == "resolved"
        else list(hidden_slots((episode, instruction))),
        pattern=cast("str | None", instruction.metadata["pattern"]),
        expressions=list(
            command_expressions(instruction.mentions, len(instruction.utterances) - 1)
        ),
        language_version=LANGUAGE_VERSIONS[options.language],
        environment_version=ENVIRONMENT_VERSION,
    )


def _choice_question(questions: Prompts, commands: Sequence[str]) -> str:
    lines = (
        questions.fill("choice_line", letter=letter, goal=command)
        for letter, command in zip(LETTERS, commands, strict=False)
    )
    return questions.fill("choice", choices="\n".join(lines))


def _points_question(questions: Prompts, episode: Episode) -> str:
    nouns = [noun(episode.task, kind) for kind in pointed_kinds(episode.task)]
    rule = questions.fill("several" if is_ordered(episode.goal) else "amounts")
    things = ", then ".join(f"the {one}" for one in nouns)
    return questions.fill("points", things=things, rule=rule, width=str(SIZE), height=str(SIZE))


def _option_fields(options: InstructionOptions) -> dict[str, Any]:
    known = GroundingItem.__struct_fields__
    fields = {name: value for name, value in asdict(options).items() if name in known}
    return {**fields, "stages": list(options.stages), "wordings": options.wordings or "own"}
