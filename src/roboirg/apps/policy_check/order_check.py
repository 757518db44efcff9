"""Check that the order in which the words of a scene are heard changes nothing."""

from __future__ import annotations

import secrets
from collections.abc import Iterator

from roboirg import language
from roboirg.apps.policy_check.check_result import FAIL, PASS, CheckResult
from roboirg.apps.policy_check.policy_player import (
    VIDEO_STEPS,
    PolicyPlayer,
    are_equal,
    describe_difference,
)
from roboirg.apps.policy_check.synthetic_episodes import SyntheticEpisodes
from roboirg.language.settings import ACCEPTANCE_SETTINGS, EXPLICIT
from roboirg.tasks.splits.splits import get_episode

NAME = "order of words"


def check_order(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that implicit words lead to the same actions before and after explicit ones."""
    if not player.repeatable:
        return
    episode = get_episode("PickXtimes", "train", 0)
    words = {name: language.instruct(episode, name).text for name in ACCEPTANCE_SETTINGS}
    # Nothing can remember this scene, not even a server that was checked before.
    scene = SyntheticEpisodes(player.needs, secrets.randbits(32)).episode("", VIDEO_STEPS)
    explicit = scene._replace(instruction=words.pop(EXPLICIT))
    implicit = [scene._replace(instruction=text) for text in words.values()]
    before = [player.play(NAME, one) for one in implicit]
    player.play(NAME, explicit)
    for one, first in zip(implicit, before, strict=True):
        after = player.play(NAME, one)
        if not are_equal(first, after):
            yield CheckResult(
                NAME,
                FAIL,
                f"{one.instruction!r} leads to other actions once {explicit.instruction!r} was "
                f"heard in the same scene (by up to {describe_difference(first, after)}): results "
                "of implicit instructions depend on the order of play. Keep nothing of an "
                "episode in the module, the class, files or the server.",
            )
            return
    yield CheckResult(NAME, PASS, "Implicit words mean the same before and after explicit ones.")
