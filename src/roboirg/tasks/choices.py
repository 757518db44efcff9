"""RoboMME's multi-choice mode: the motions that a program may choose in a task.

A task's choices follow from its stages, in their order: one for each kind of motion, and for each
button. Where several things can be meant, a choice needs a point of the front picture.
"""

from __future__ import annotations

import string
from collections.abc import Iterator

from roboirg.core.choices import Choice
from roboirg.core.episode import Episode, Primitive, Scene
from roboirg.tasks import get_task

_WORDS = {
    "pick_cube": "pick up the {subject}",
    "pick_container": "pick up the container",
    "place_on": "place it on the {place}",
    "drop_into": "drop it into the {place}",
    "put_into": "put it into the {place}",
    "move_over": "move it over the {place}",
    "put_down": "put it down",
    "press": "press the {subject}",
    "press_below": "press the button at once",
    "hover": "move above the button",
    "retreat": "move back and wait",
    "hold_until": "hold still until the next checkpoint",
}
_PRESSES = ("press", "press_below")


def choices_of(episode: Episode) -> tuple[Choice, ...]:
    """Return the choices of an episode; they are the same in all episodes of a task."""
    scene = episode.scene
    motions = list(dict.fromkeys(_motions(scene, episode)))
    buttons = sorted(scene.of_kind("button"), key=lambda one: one.position.y)
    presses = [one for one in motions if one.kind in _PRESSES]
    if not presses and buttons:
        motions.append(Primitive("press", buttons[0].name))
    elif len(presses) > 1:  # as in RoboMME, the button at smaller y comes first
        ordered = iter(Primitive("press", one.name) for one in buttons)
        motions = [next(ordered) if one in presses else one for one in motions]
    checkpoints = tuple(
        stage.primitive for stage in episode.stages if stage.primitive.kind == "hold_until"
    )
    return tuple(
        _choice(label, motion, scene, checkpoints)
        for label, motion in zip(string.ascii_lowercase, motions, strict=False)
    )


def _motions(scene: Scene, episode: Episode) -> Iterator[Primitive]:
    """Yield the motions of all goals' stages, those for the same choice being equal."""
    task = get_task(episode.task)
    for goal in task.goals(scene):
        for stage in task.stages(scene, goal):
            motion = stage.primitive
            if motion.kind in _PRESSES:
                yield motion._replace(steps=0)
            elif motion.kind in ("hover", "retreat"):
                yield motion
            else:
                kind = "" if motion.subject == "robot" else scene[motion.subject].kind
                place = None if motion.place is None else scene[motion.place].kind
                yield motion._replace(subject=kind, place=place, steps=0)


def _choice(
    label: str, motion: Primitive, scene: Scene, checkpoints: tuple[Primitive, ...]
) -> Choice:
    words = _WORDS[motion.kind].format(
        subject=motion.subject.replace("_", " "), place=motion.place or "place"
    )
    if motion.kind == "hold_until":
        return Choice(label, words, checkpoints)
    if motion.kind.startswith("pick_"):
        return Choice(label, words, (motion,), motion.subject)
    places = scene.of_kind(motion.place) if motion.place else ()
    if len(places) == 1:
        return Choice(label, words, (motion._replace(place=places[0].name),))
    return Choice(label, words, (motion,), motion.place)
