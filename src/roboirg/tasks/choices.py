"""RoboMME's multi-choice mode: the motions that a program may choose in a task.

A task's choices follow from its stages, in their order: one for each kind of motion, and for each
button. Where several things can be meant, a choice needs a point of the front picture.
"""

from __future__ import annotations

import string
from collections.abc import Iterator

from roboirg.core.choices import Choice
from roboirg.core.episode import ROBOT, Episode, ObjectKind, Primitive, Scene
from roboirg.tasks import get_task, goals_of

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
    """Return the choices of an episode; they are the same in all episodes of a task.

    A choice is a labeled motion that a program can ask for. PickXtimes -> a *pick up the cube*, b
    *place it on the target*, c *press the button*; with a, a point of the picture says which cube.
    """
    each_once = list(dict.fromkeys(_motions(episode)))
    motions = _with_buttons(each_once, episode.scene)
    labeled = zip(string.ascii_lowercase, motions, strict=False)
    return tuple(_choice(label, motion, episode) for label, motion in labeled)


def _with_buttons(motions: list[Primitive], scene: Scene) -> list[Primitive]:
    """Return motions with a press for each button; as in RoboMME, that at smaller y comes first.

    Two presses among `motions` keep their two positions; only which button is pressed is set anew.
    A task whose stages press nothing gets a press of the first button, if there is one.
    """
    buttons = sorted(scene.of_kind("button"), key=lambda button: button.position.y)
    presses = [motion for motion in motions if motion.kind in _PRESSES]
    if not presses and buttons:
        return [*motions, Primitive("press", buttons[0].name)]
    if len(presses) <= 1:
        return motions
    # Several presses are one for each button, in the order of the stages; they change places.
    ordered = list(motions)
    for press, button in zip(presses, buttons, strict=True):
        ordered[motions.index(press)] = Primitive("press", button.name)
    return ordered


def _motions(episode: Episode) -> Iterator[Primitive]:
    """Yield the motions of all goals' stages, those for the same choice being equal.

    Names of objects become kinds: picking ``cube_red`` and ``cube_blue`` are both picking a
    ``cube``, and a point says which one. Presses, hovering and retreating keep their object.
    Callers drop repeats.
    """
    task = get_task(episode.task)
    scene = episode.scene
    for goal in goals_of(episode):
        for stage in task.stages(scene, goal):
            motion = stage.primitive
            if motion.kind in _PRESSES:
                yield motion._replace(steps=0)
            elif motion.kind in ("hover", "retreat"):
                yield motion
            else:
                yield motion._replace(
                    subject=_kind_of(motion.subject, scene) or "",
                    place=_kind_of(motion.place, scene),
                    steps=0,
                )


def _kind_of(name: str | None, scene: Scene) -> ObjectKind | None:
    """Return the kind of the object of a name, ``"cube_red"`` -> ``"cube"``.

    None if `name` is None or the robot, which is no object of the scene.
    """
    return None if name in (None, ROBOT) else scene[str(name)].kind


def _words_for(motion: Primitive) -> str:
    """Return a motion in words, its objects by their kinds: ``place it on the target``."""
    subject = motion.subject.replace("_", " ")
    return _WORDS[motion.kind].format(subject=subject, place=motion.place or "place")


def _choice(label: str, motion: Primitive, episode: Episode) -> Choice:
    """Return the choice of a motion: with a point of its kind of object, if there are several.

    A pick always takes a point. With a single target in the scene, placing names that target; with
    several, it takes a point of a target. Waiting is one choice, which is made again for each of
    the episode's checkpoints.
    """
    words = _words_for(motion)
    if motion.kind == "hold_until":
        stages = [stage.primitive for stage in episode.stages]
        return Choice(label, words, tuple(stage for stage in stages if stage.kind == motion.kind))
    if motion.kind.startswith("pick_"):
        return Choice(label, words, (motion,), motion.subject)
    places = episode.scene.of_kind(motion.place) if motion.place else ()
    if len(places) == 1:
        motion = motion._replace(place=places[0].name)
        return Choice(label, words, (motion,))
    return Choice(label, words, (motion,), motion.place)
