"""Description of an episode in words and tables, for the terminal."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import replace

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from roboirg.apps.show.episode_strip import SpokenSetting
from roboirg.core.conditions import Fact
from roboirg.core.episode import Episode, Scene, SceneObject
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.motions import Away, Glow, Motion, Point, Shuttle, Swap, Vanish
from roboirg.judging import plain_subgoal
from roboirg.language.generator import find_refusal, instruct_with
from roboirg.language.settings import all_settings
from roboirg.shortcuts.command_chance import is_right, understood_goals

MINIMUM_WIDTH = 100
"""Columns if the output is not a terminal."""


def print_episode(
    episode: Episode, settings: Sequence[str], options: InstructionOptions, console: Console
) -> None:
    """Print objects, motions, video, goal, and the instruction in some settings.

    Where the output is no terminal, lines have at least `MINIMUM_WIDTH` characters: the width of
    `console` changes.
    """
    if not console.is_terminal:
        console.width = max(console.width, MINIMUM_WIDTH)
    console.print(
        f"[bold]{episode.key}[/] {episode.difficulty}, seed {episode.seed}", highlight=False
    )
    console.print(objects_table(episode.scene))
    _print_list("moves by itself", describe_motions(episode.scene), console)
    _print_list("the video shows", describe_video(episode), console)
    goal = ", ".join(f"{slot} {_value(value)}" for slot, value in episode.goal.slots)
    _print_list("goal", [goal], console)
    console.print(instructions_table(episode, settings, options))


def objects_table(scene: Scene) -> Table:
    """Return a table of all objects with their initial positions (m) and yaw (degrees)."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
    for name in ("object", "kind", "color"):
        table.add_column(name)
    for name in ("x", "y", "z", "yaw"):
        table.add_column(name, justify="right")
    for item in scene.objects:
        position = [f"{value:.3f}" for value in item.position]
        yaw = f"{math.degrees(item.yaw):.0f}°"
        table.add_row(item.name, _kind(item), item.color or "", *position, yaw)
    return table


def describe_motions(scene: Scene) -> list[str]:
    """Return a line for each scripted motion; objects with the same motion share it.

    ``["cube_1, cube_2: away until step 80"]``, in the order of the scene.
    """
    movers = defaultdict(list)
    for motion in scene.motions:
        movers[_motion_words(motion)].append(_mover(motion))
    return [f"{', '.join(names)}: {words}" for words, names in movers.items()]


def describe_video(episode: Episode) -> list[str]:
    """Return lines on the video: its numbered stages, then the acts that instructions refer to.

    ``["1. pick up the cube", …, "that is: cube_red placed on target_0"]``; none without a video.
    """
    shown = [plain_subgoal(stage) for stage in episode.demonstration if stage.in_video]
    lines = [f"{number}. {words}" for number, words in enumerate(shown, start=1)]
    if episode.scene.past:
        facts = [fact_words(fact) for fact in episode.scene.past]
        lines.append(f"that is: {', '.join(facts)}")
    return lines


def fact_words(fact: Fact) -> str:
    """Return a fact in words, with the objects' names: ``cube_1 placed on target_2``."""
    parts = (fact.subject, fact.traits.state, fact.place)
    return " ".join(part for part in parts if part)


def instructions_table(
    episode: Episode, settings: Sequence[str], options: InstructionOptions
) -> Table:
    """Return a table of the instruction in each setting, implicit and resolved.

    The explicit setting has one form only. A setting that cannot express the episode has the reason
    instead, and one whose words fit another goal, too, a warning in the next row.
    """
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_lines=False)
    table.add_column("setting", style="bold")
    table.add_column("form", style="dim")
    table.add_column("instruction", overflow="fold")
    for setting in settings:
        chosen = replace(options, setting=setting)
        refusal = find_refusal(episode, chosen)
        if refusal:
            table.add_row(setting, "", f"cannot express the episode: {escape(refusal)}")
            continue
        title = setting
        for form in ("implicit", "resolved"):
            if form == "resolved" and setting == "explicit":
                continue
            instruction = instruct_with(episode, replace(chosen, form=form))
            table.add_row(title, form, escape(instruction.text))
            title = ""
            goals = understood_goals(instruction, episode)
            if not all(is_right(goal, episode) for goal in goals):
                table.add_row("", "", "[red]can also mean another goal[/]")
    return table


def spoken_settings(
    episode: Episode, settings: Sequence[str], options: InstructionOptions
) -> list[SpokenSetting]:
    """Return what is said in each setting that can express the episode, in their order."""
    said = []
    for setting in settings:
        chosen = replace(options, setting=setting)
        if not find_refusal(episode, chosen):
            words = instruct_with(episode, chosen).text
            color = all_settings()[setting].color
            said.append(SpokenSetting(setting, words, color))
    return said


def _mover(motion: Motion) -> str:
    """Return the names of what moves."""
    if isinstance(motion, Swap):
        return f"{motion.first} and {motion.second}"
    return motion.subject


def _motion_words(motion: Motion) -> str:
    """Return a movement in words, without what moves: ``away until step 80``."""
    match motion:
        case Away():
            words = "away"
            if motion.start:
                words += f" from step {motion.start}"
            words += f" until step {motion.end}"
            if motion.under:
                words += f", then under {motion.under}"
            return words
        case Swap():
            end = motion.start + motion.steps
            words = f"change places, step {motion.start} to {end}"
            if motion.stage is not None:
                words += f" of the video's stage {motion.stage + 1}"
            return words
        case Shuttle():
            way = f"runs from {_plane(motion.begin)} to {_plane(motion.end)} and back"
            passes = f"{motion.passes} passes of {motion.interval} steps"
            return f"{way}, {passes}, until {fact_words(motion.stopped_by)}"
        case Glow():
            return f"seen while {fact_words(motion.during)}, and {motion.linger} steps longer"
        case Vanish():
            words = fact_words(motion.when).removeprefix(f"{motion.subject} ")
            return f"gone for good once {words}"


def _print_list(title: str, lines: list[str], console: Console) -> None:
    """Print lines under a title, or nothing if there are none."""
    if lines:
        console.print(f"[bold]{title}[/]")
    for line in lines:
        console.print(Padding.indent(escape(line), 2), highlight=False)


def _kind(item: SceneObject) -> str:
    """Return the kind of an object in words: ``hidden cube in container_1``."""
    kind = item.kind.replace("_", " ")
    if item.inside:
        kind += f" in {item.inside}"
    return kind


def _plane(point: Point) -> str:
    """Return a point without its height: ``"(0.10, -0.05)"``, meters."""
    return f"({point.x:.2f}, {point.y:.2f})"


def _value(value: object) -> str:
    """Return the value of a goal's slot in words; some slots have several values."""
    if isinstance(value, tuple):
        return " and ".join(str(part) for part in value)
    return str(value)
