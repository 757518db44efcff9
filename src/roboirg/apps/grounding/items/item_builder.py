"""Make the items of one episode: every wanted instruction, with its questions and answers."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, astuple, replace
from typing import Any

from roboirg.apps.grounding.items.goal_choices import GoalChoices, draw_choices
from roboirg.apps.grounding.items.grounding_item import LETTERS, GroundingItem
from roboirg.apps.grounding.items.media_store import EpisodeMedia
from roboirg.apps.grounding.items.referents import is_ordered, noun, pointed_kinds
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import PICTURE_SIZE
from roboirg.core.word_pools import POOLS, pool_of
from roboirg.language import instruct_with
from roboirg.language.generator import find_refusal
from roboirg.language.instruction import Instruction, command_expressions
from roboirg.language.scenarios.identity import language_label
from roboirg.language.settings import all_settings, settings_of
from roboirg.language.word_sampler import LANGUAGE_VERSION
from roboirg.policies.vlm.goal_schema import goal_schema
from roboirg.policies.vlm.listener_query import PROMPTS, question_texts
from roboirg.policies.vlm.prompt_files import load_prompts
from roboirg.shortcuts.command_chance import blind_goals, is_right, right_share
from roboirg.shortcuts.shortcut_scores import hidden_slots
from roboirg.tasks import get_task, with_goal

QUESTIONS = "grounding_questions"
"""Name of the prompts for the questions that the listener does not ask."""
ID_DIGITS = 16


def wanted_options(
    episode: Episode,
    settings: Sequence[str],
    forms: Sequence[str],
    options: InstructionOptions,
    *,
    every_variant: bool,
) -> Iterator[InstructionOptions]:
    """Yield the instruction options for which an episode gets a question, each once.

    Settings that the task lacks or that cannot express the episode are left out. An option that a
    setting does not use keeps its default.

    Args:
        episode: the episode.
        settings: names of settings.
        forms: implicit, resolved or both; explicit has one form.
        options: values of all other options.
        every_variant: whether to add every combination of options that changes the words of a
            setting.
    """
    available = settings_of(get_task(episode.task))
    for name in settings:
        if name in available:
            found = _options_of(name, forms, options, every_variant=every_variant)
            for wanted in dict.fromkeys(found):
                if find_refusal(episode, wanted) is None:
                    yield wanted


def _options_of(
    name: str, forms: Sequence[str], options: InstructionOptions, *, every_variant: bool
) -> Iterator[InstructionOptions]:
    """Yield the instruction options for which a setting gets questions; some may come twice.

    Args:
        name: of the setting.
        forms: implicit, resolved or both; explicit has one form.
        options: values that are used, of those that the setting reads; others keep their defaults.
        every_variant: whether to add every combination of options that changes the words.
    """
    setting = all_settings()[name]
    read = {str(option): getattr(options, option) for option in setting.reads - {"delivery"}}
    variants: list[Mapping[str, Any]] = [read]
    if every_variant:
        variants += setting.variants
    usual = InstructionOptions(name, wordings=options.wordings)
    if not setting.implicit:
        forms = (usual.form,)
    for changes in variants:
        for form in forms:
            yield replace(usual, form=form, **changes)


def make_items(
    episode: Episode, media: EpisodeMedia, wanted: Sequence[InstructionOptions]
) -> list[GroundingItem]:
    """Return an item of an episode for each of the options."""
    return [_make_item(episode, media, options) for options in wanted]


def item_id(episode: Episode, options: InstructionOptions) -> str:
    """Return the name of an item, such as ``g1a2b3c4d5e6f7a8b``.

    A hash of episode, options and versions, which gives nothing away about the answer. Any change
    of what is hashed renames all items, so that old answers do not fit the new questions.
    """
    pool = pool_of(episode.split, options.wordings)
    content = (
        episode.key,
        *astuple(options),
        language_label([episode.task], pool, [options.setting], options.wordings),
        ENVIRONMENT_VERSION,
    )
    return "g" + hashlib.sha256(repr(content).encode()).hexdigest()[:ID_DIGITS]


def _make_item(episode: Episode, media: EpisodeMedia, options: InstructionOptions) -> GroundingItem:
    """Return the item, questions and right answers, of one instruction of an episode."""
    instruction = instruct_with(episode, options)
    name = item_id(episode, options)
    choices = draw_choices(episode, instruction, name)
    return GroundingItem(
        id=name,
        **_episode_fields(episode),
        **_option_fields(options),
        **_media_fields(media),
        **_instruction_fields(episode, instruction, options),
        **_slots_question(episode, instruction, media),
        **_choice_question(episode, instruction, choices),
        **_points_question(episode),
        **_answer_fields(episode, choices),
        language_version=LANGUAGE_VERSION,
        environment_version=ENVIRONMENT_VERSION,
    )


def _episode_fields(episode: Episode) -> dict[str, Any]:
    """Return which episode an item is of."""
    task = get_task(episode.task)
    return {
        "task": task.name,
        "suite": task.suite,
        "split": episode.split,
        "episode": episode.index,
        "difficulty": episode.difficulty,
    }


def _option_fields(options: InstructionOptions) -> dict[str, Any]:
    """Return the fields of an item on the options of its instruction: setting, form, and so on."""
    known = GroundingItem.__struct_fields__
    fields = {name: value for name, value in asdict(options).items() if name in known}
    fields["stages"] = list(options.stages)
    fields["wordings"] = options.wordings or "own"
    return fields


def _media_fields(media: EpisodeMedia) -> dict[str, Any]:
    """Return what is shown, and where the things that are meant are seen."""
    return {
        "picture": media.picture,
        "video": media.video,
        "video_steps": media.steps,
        "frames": list(media.frames),
        "points": list(media.points),
    }


def _instruction_fields(
    episode: Episode, instruction: Instruction, options: InstructionOptions
) -> dict[str, Any]:
    """Return the fields of an item on its instruction: its words, and what the command leaves open.

    The command is the last utterance. ``command_chance`` is the success of a guess among the goals
    that fit the command alone, 0 to 1, or None; ``hidden_slots`` are the goal's values that only
    the words before the command name.
    """
    hidden = []
    if options.form != "resolved":  # a resolved command leaves none to its context
        hidden = list(hidden_slots((episode, instruction)))
    chance = right_share(blind_goals(instruction, episode), episode)
    last = len(instruction.utterances) - 1
    return {
        "text": instruction.text,
        "turns": list(instruction.turns),
        "command_chance": None if chance is None else float(chance),
        "hidden_slots": hidden,
        "pattern": instruction.metadata["pattern"],
        "expressions": list(command_expressions(instruction.mentions, last)),
    }


def _slots_question(
    episode: Episode, instruction: Instruction, media: EpisodeMedia
) -> dict[str, Any]:
    """Return the listener's question, whose answer is slots, and the texts of all questions."""
    schema = goal_schema(episode.task)
    texts = question_texts(load_prompts(PROMPTS), schema, instruction.text, media.steps)
    return {
        "slots_system": texts.system,
        "system": load_prompts(QUESTIONS).fill("system"),
        "said": texts.instruction,
        "shown": texts.video,
        "now": texts.now,
        "slots_question": texts.question,
        "schema": json.dumps(schema.schema(), separators=(",", ":")),
    }


def _choice_question(
    episode: Episode, instruction: Instruction, choices: GoalChoices
) -> dict[str, Any]:
    """Return the multiple-choice question: the choices in words, and the right letter.

    Goals are said explicitly, and with words of the other pool (training or test) than the
    instruction has, so that a choice cannot be found by comparing words.
    """
    questions = load_prompts(QUESTIONS)
    (other_pool,) = set(POOLS) - {instruction.metadata["pool"]}
    explicit = InstructionOptions(wordings=other_pool)
    commands = [instruct_with(with_goal(episode, goal), explicit).text for goal in choices.goals]
    lines = []
    for letter, command in zip(LETTERS, commands, strict=False):
        lines.append(questions.fill("choice_line", letter=letter, goal=command))
    return {
        "choice_question": questions.fill("choice", choices="\n".join(lines)),
        "choices": commands,
        "choice": LETTERS[choices.right],
    }


def _points_question(episode: Episode) -> dict[str, Any]:
    """Return the question to point at the things that are meant, and whether they have an order.

    *the cube, then the target*: they have one where things are handled one after the other, and
    none where the goal is how many of each color.
    """
    questions = load_prompts(QUESTIONS)
    is_sequence = is_ordered(episode.goal)
    nouns = [noun(episode.task, kind) for kind in pointed_kinds(episode.task)]
    question = questions.fill(
        "points",
        things=", then ".join(f"the {name}" for name in nouns),
        rule=questions.fill("several" if is_sequence else "amounts"),
        width=str(PICTURE_SIZE),
        height=str(PICTURE_SIZE),
    )
    return {"points_question": question, "points_in_order": is_sequence}


def _answer_fields(episode: Episode, choices: GoalChoices) -> dict[str, Any]:
    """Return the fields of an item on its answers, each a goal as JSON.

    They are the right answer, all that are equally right, those of every goal of the scene, and
    those of the choices.
    """
    answers = goal_schema(episode.task).answers
    right = []
    every_answer = []
    for goal in get_task(episode.task).goals(episode.scene):
        every_answer.append(answers[goal])
        if is_right(goal, episode):
            right.append(answers[goal])
    return {
        "answer": answers[episode.goal],
        "answers": right,
        "goals": every_answer,
        "choice_answers": [answers[goal] for goal in choices.goals],
    }
