"""The spatial setting: the introduction names a place instead of a color; the command points there.

Counts stay explicit.
"""

from __future__ import annotations

from roboirg.language.landmarks import FRAMES
from roboirg.language.places import things_at
from roboirg.language.request import InstructionRequest
from roboirg.language.settings.setting import Setting


def refusal(request: InstructionRequest) -> str | None:
    """Return why no place can say the goal; None if any thing that it is about has a place.

    A place is words that single out one thing by where it stands, *on the left*. The text is the
    end of a sentence, without a stop.
    """
    kind = request.task.things.pointed
    things_with_place = things_at(request.episode.scene, kind, request.frame).values()
    for color in request.color_values:
        for thing in request.objects_to_point_at(color):
            if thing in things_with_place:
                return None
    return "no landmark singles out a target"


SETTING = Setting(
    name="spatial",
    order=4,
    summary="a place identifies the object; the command points there",
    color="#CC79A7",
    content_plans="spatial",
    applies_to=lambda task: task.spatial,
    refusal=refusal,
    reads=frozenset({"frame", "delivery"}),
    variants=tuple({"frame": frame} for frame in FRAMES),
    example=6,
)
