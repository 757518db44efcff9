"""What the page shows of a question: words, pictures, outlines of things, values. No answer."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import cv2
import numpy as np

from roboirg.apps.people.answer_form import answer_form
from roboirg.core.delivery import TURNS
from roboirg.core.episode import Episode
from roboirg.evaluation.grounding_items.grounding_item import GroundingItem, Mask, PointTarget
from roboirg.evaluation.grounding_items.item_builder import EpisodeMedia
from roboirg.evaluation.grounding_items.referents import noun
from roboirg.evaluation.records.record import Job
from roboirg.policies.vlm.goal_schema import AMOUNT, Field, goal_schema

MARGIN = 2
"""Pixels by which an outline keeps off its thing, so that it hides nothing of it."""
_QUESTIONS = {
    "number": "How many times?",
    "visit": "At which visit, counted from the first?",
    "relation": "Before or after?",
    "color": "Which color?",
    AMOUNT: "How many {name} {thing}s?",
}


class PersonView(NamedTuple):
    """A question as a person sees it.

    Attributes:
        things: names of the objects that can be pointed at, from left to right in the picture.
        shown: what is sent to the page.
    """

    things: tuple[str, ...]
    shown: dict[str, Any]


def view_question(
    job: Job, episode: Episode, item: GroundingItem, media: EpisodeMedia
) -> PersonView:
    form = answer_form(job.task)
    seen = [
        (name, target)
        for name, target in media.objects.items()
        if episode.scene[name].kind in form.kinds
    ]
    # By place alone: the order of the scene could give away what is meant.
    seen.sort(key=lambda one: (one[1].x, one[1].y))
    shown = {
        "turns": item.turns if job.options.delivery == TURNS else [item.text],
        "picture": item.picture,
        "video": item.video,
        "points": [noun(job.task, kind) for kind in form.kinds],
        "least": form.least,
        "things": [_thing(noun(job.task, episode.scene[one].kind), target) for one, target in seen],
        "fields": [_field(job.task, field) for field in form.fields],
    }
    return PersonView(tuple(name for name, _ in seen), shown)


def _field(task: str, field: Field) -> dict[str, Any]:
    question = _QUESTIONS.get(field.kind, "Which {name}?")
    words = {"name": field.name, "thing": goal_schema(task).thing}
    return {
        "name": field.name,
        "question": question.format(**words),
        "values": list(field.values),
    }


def _thing(word: str, target: PointTarget) -> dict[str, Any]:
    return {"noun": word, "x": target.x, "y": target.y, "outlines": outlines(target.mask)}


def outlines(mask: Mask) -> list[str]:
    """Return polygons around the pixels of a mask, each as the points of an SVG polygon."""
    size = 2 * MARGIN + 1
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size))
    grown = cv2.dilate(mask.astype(np.uint8), kernel)
    found, _ = cv2.findContours(grown, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_TC89_L1)
    large: Sequence[Any] = sorted(found, key=cv2.contourArea, reverse=True)
    return [
        " ".join(f"{x + 0.5:g},{y + 0.5:g}" for x, y in contour[:, 0].tolist())
        for contour in large
        if len(contour) > 2  # noqa: PLR2004 - a line encloses nothing
    ]
