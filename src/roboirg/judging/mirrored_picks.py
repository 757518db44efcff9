"""Tell picks of the object on the other side from those of any other wrong object."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from roboirg.core.conditions import facts_of
from roboirg.judging.episode_replay import EpisodeReplay
from roboirg.judging.failure_attribution import FailureAttribution

MirroredObjects = Mapping[str, Collection[str]]
"""For each object that an instruction means, those that it would mean with left and right
exchanged."""


def refine_wrong_object(
    found: FailureAttribution, replay: EpisodeReplay, mirrored: MirroredObjects, place: str | None
) -> FailureAttribution:
    """Return a ``mirrored_pick`` if the wrong object or place is the mirrored one.

    The mirrored one of which object depends on the order: it is the one that the current stage
    expects or, if it expects none that the words mean, the last one before or the next one after.
    The step of `found` counts since the world began; `place` is None if the act has none.
    """
    if found.failure not in ("wrong_object", "wrong_place"):
        return found
    meant = _meant_objects(replay, mirrored, max(replay.expected_stages[found.step], 0))
    sides = {other for name in meant for other in mirrored[name]}
    if not sides & {found.subject, place}:
        return found
    words = f"{found.sentence[:-1]}; the words mean it only with left and right exchanged"
    return FailureAttribution.of("mirrored_pick", found.subject, found.step, words)


def _meant_objects(
    replay: EpisodeReplay, mirrored: MirroredObjects, current: int
) -> frozenset[str]:
    """Return the objects named by places that a stage expects, looking first back, then ahead."""
    stages = replay.stages
    for stage in (*reversed(stages[: current + 1]), *stages[current + 1 :]):
        facts = facts_of(stage.expects)
        names = {name for fact in facts for name in (fact.subject, fact.place)}
        if meant := names & mirrored.keys():
            return frozenset(name for name in meant if name is not None)
    return frozenset()
