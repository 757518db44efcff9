"""Description of an episode in words and tables, for the terminal."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.padding import Padding
from rich.table import Table

from roboirg.core.conditions import Fact
from roboirg.core.episode import Episode, Scene, SceneObject
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.motions import Away, Glow, Motion, Point, Shuttle, Swap, Vanish
from roboirg.judging import plain_subgoal
from roboirg.language.generator import find_refusal, instruct_with
from roboirg.reader import interpret

MINIMUM_WIDTH = 100
"""Columns if the output is not a terminal."""


def print_episode(
    episode: Episode, settings: Sequence[str], options: InstructionOptions, console: Console
) -> None:
    """Print objects, motions, video, goal, and the instruction in some settings."""
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
        place = (f"{value:.3f}" for value in item.position)
        yaw = f"{math.degrees(item.yaw):.0f}°"
        table.add_row(item.name, _kind(item), item.color or "", *place, yaw)
    return table


def describe_motions(scene: Scene) -> list[str]:
    """Describe the scripted motions; objects with the same motion share a line."""
    subjects: dict[str, list[str]] = {}
    for motion in scene.motions:
        subject, words = _motion_words(motion)
        subjects.setdefault(words, []).append(subject)
    return [f"{', '.join(names)}: {words}" for words, names in subjects.items()]


def describe_video(episode: Episode) -> list[str]:
    """Describe the stages of the demonstration and the facts that instructions refer to."""
    shown = [plain_subgoal(stage) for stage in episode.demonstration if stage.in_video]
    lines = [f"{number}. {words}" for number, words in enumerate(shown, start=1)]
    if episode.scene.past:
        lines.append("that is: " + ", ".join(fact_words(fact) for fact in episode.scene.past))
    return lines


def fact_words(fact: Fact) -> str:
    """Return a fact in words, with the objects' names."""
    return " ".join(part for part in (fact.subject, fact.traits.state, fact.place) if part)


def instructions_table(
    episode: Episode, settings: Sequence[str], options: InstructionOptions
) -> Table:
    """Return a table of the instruction in each setting, implicit and resolved."""
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, show_lines=False)
    table.add_column("setting", style="bold")
    table.add_column("form", style="dim")
    table.add_column("instruction", overflow="fold")
    for setting in settings:
        chosen = replace(options, setting=setting)
        if refusal := find_refusal(episode, chosen):
            table.add_row(setting, "", f"cannot express the episode: {escape(refusal)}")
            continue
        for form in ("implicit",) if setting == "explicit" else ("implicit", "resolved"):
            text = instruct_with(episode, replace(chosen, form=form)).text
            table.add_row(setting if form == "implicit" else "", form, escape(text))
            for complaint in interpret(text, episode.scene, episode.task).not_understood:
                table.add_row("", "", f"[red]the interpreter {escape(complaint)}[/]")
    return table


def _motion_words(motion: Motion) -> tuple[str, str]:
    """Return the object that moves, and its movement in words."""
    match motion:
        case Away(subject, start, end, under):
            begin = f"away from step {start}" if start else "away"
            back = f", then under {under}" if under else ""
            return subject, f"{begin} until step {end}{back}"
        case Swap(first, second, start, steps, _, _, stage):
            since = "" if stage is None else f" of the video's stage {stage + 1}"
            return f"{first} and {second}", f"change places, step {start} to {start + steps}{since}"
        case Shuttle(subject, begin, end, interval, passes, stopped_by):
            return subject, (
                f"runs from {_plane(begin)} to {_plane(end)} and back, {passes} passes of "
                f"{interval} steps, until {fact_words(stopped_by)}"
            )
        case Glow(subject, during, linger):
            return subject, f"seen while {fact_words(during)}, and {linger} steps longer"
        case Vanish(subject, when):
            words = fact_words(when)
            return subject, f"gone for good once {words.removeprefix(f'{subject} ')}"


def _print_list(title: str, lines: list[str], console: Console) -> None:
    if lines:
        console.print(f"[bold]{title}[/]")
    for line in lines:
        console.print(Padding.indent(escape(line), 2), highlight=False)


def _kind(item: SceneObject) -> str:
    return item.kind.replace("_", " ") + (f" in {item.inside}" if item.inside else "")


def _plane(point: Point) -> str:
    return f"({point.x:.2f}, {point.y:.2f})"


def _value(value: object) -> str:
    return " and ".join(str(part) for part in value) if isinstance(value, tuple) else str(value)
