"""Checks of what changes a policy's answers: words, pictures, state, video.

Answers are compared bit by bit, so that a finding is certain as far as it was asked. A policy of
which two equal episodes differ cannot be checked so.
"""

from __future__ import annotations

import secrets
from collections.abc import Iterator, Sequence

import numpy as np

from roboirg import language
from roboirg.apps.policy_check.check_result import FAIL, NOTE, PASS, WARN, CheckResult
from roboirg.apps.policy_check.policy_player import (
    SECOND,
    VIDEO_STEPS,
    PolicyPlayer,
    are_equal,
    describe_difference,
)
from roboirg.apps.policy_check.synthetic_episodes import SyntheticEpisode, SyntheticEpisodes
from roboirg.language.settings import ACCEPTANCE_SETTINGS, EXPLICIT
from roboirg.tasks.splits.splits import get_episode

STATE_FIELDS = ("joint_positions", "gripper", "end_effector")
OTHER_COMMANDS = (
    "Pick up the green cube and put it into the bin three times.",
    "Stop the cube when it reaches the target for the second time.",
)
MAX_WORDS = 48
"""The longest instructions of the test split have 47 words (spatial) and 46 (contextual)."""
_REMARKS = (
    "The table was set up this morning and all of its things are in place. "
    "There is a lamp on the left and a clock on the wall behind you. "
    "We had a good day so far and there is a lot of time for this work."
)
_ENDS = "Now press the button that is red.", "Now press the button that is blue."
"""Differ in the last word."""
_UNLIKE_ENDS = (
    "Now take all of the cubes out of the bin and stop for a while.",
    "Press the third button two times, then follow the line to the end.",
)
_ROOM = MAX_WORDS - len(_ENDS[0].split())
_MAX_TOKENS_PER_WORD = 3


def check_constant(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that not every action is the same one, and that answers follow the observations."""
    rollouts = player.first_rollout, player.expected
    rows = np.concatenate([chunk for rollout in rollouts for chunk in rollout.chunks])
    player.constant = bool((rows == rows[0]).all())
    if player.constant:
        yield CheckResult(
            "constant",
            WARN,
            f"All {len(rows)} actions of two episodes are the same; usually the model's output is "
            "not read, or a server answers with a placeholder.",
        )
    elif all(_repeats(rollout.chunks) for rollout in rollouts):
        yield CheckResult(
            "repetition",
            WARN,
            "Every answer of an episode repeats the first although all inputs have changed; "
            "usually a chunk is kept and never recomputed. Clear it once its actions are "
            "returned.",
        )


def _repeats(chunks: Sequence[np.ndarray[tuple[int, ...], np.dtype[np.float64]]]) -> bool:
    return all(np.array_equal(chunk, chunks[0]) for chunk in chunks)


def check_language(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that the instruction changes the answers."""
    name = "language"
    if not _can_compare(player):
        yield from _not_checked(player, name)
        return
    if any(_changes(player, name, instruction=words) for words in OTHER_COMMANDS):
        yield CheckResult(name, PASS, "Other instructions lead to other actions.")
        yield from check_prompt_end(player)
    else:
        yield CheckResult(
            name,
            WARN,
            f"{len(OTHER_COMMANDS) + 1} instructions lead to the same actions, bit for bit; "
            "usually the words do not reach the model. Check the prompt's name in the request, "
            "and that reset() keeps the instruction.",
        )


def check_prompt_end(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that the end of an instruction as long as the benchmark's is read."""
    name = "prompt end"
    if not _reads_end(player, 0):
        # Its answers do not tell the two commands apart, wherever they stand.
        return
    if _reads_end(player, _ROOM):
        yield CheckResult(name, PASS, f"The last words of {MAX_WORDS} change the actions.")
        return
    heard, lost = 0, _ROOM
    while lost - heard > 1:
        middle = (heard + lost) // 2
        heard, lost = (middle, lost) if _reads_end(player, middle) else (heard, middle)
    if _reads_end(player, _ROOM, _UNLIKE_ENDS):
        # It hears the end, but one word there is too little to change an answer.
        return
    declared = player.needs.prompt_tokens
    words = len(_long_prompt(lost, _ENDS[0]).split())
    if declared is not None and words * _MAX_TOKENS_PER_WORD >= declared:
        yield CheckResult(
            name,
            NOTE,
            f"The last of {words} words changes nothing, as the policy declares a limit of "
            f"{declared} tokens.",
        )
        return
    yield CheckResult(
        name,
        WARN,
        f"The last of {words} words changes nothing: the prompt is cut, and the command comes at "
        f"its end. Instructions have up to {MAX_WORDS} words; raise the model's limit of tokens, "
        "or declare it as prompt_tokens.",
    )


def check_pictures(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that the pictures of each camera that it asks for change the answers."""
    name, cameras = "pictures", player.needs.cameras
    if not cameras:
        return
    if not _can_compare(player):
        yield from _not_checked(player, name)
        return
    depth = player.needs.depth
    ignored = [
        camera
        for camera in cameras
        if not _changes(
            player, name, fields=[f"{camera}_rgb", *([f"{camera}_depth"] if depth else [])]
        )
    ]
    if not ignored:
        yield CheckResult(name, PASS, f"Pictures of {' and '.join(cameras)} change the actions.")
        return
    which = " and ".join(ignored)
    seen = f"Other pictures of {which} lead to the same actions, bit for bit"
    if len(ignored) < len(cameras) and _changes_with_video(player, name, ignored):
        yield CheckResult(name, NOTE, f"{seen}; those in the video change them.")
        return
    yield CheckResult(
        name,
        WARN,
        f"{seen}; usually the current pictures do not reach the model, or one camera's pictures "
        "are passed twice. If the policy does not need a camera, remove it from `cameras` to "
        "save rendering.",
    )


def check_state(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Note whether joints, fingers and tool change the answers."""
    name = "state"
    if not _can_compare(player):
        return
    if _changes(player, name, fields=STATE_FIELDS):
        yield CheckResult(name, PASS, "Joints, fingers or tool change the actions.")
    else:
        yield CheckResult(
            name,
            NOTE,
            "Joints, fingers and tool change nothing, which is right for a model of pictures "
            "alone and wrong if it was trained with the robot's state.",
        )


def check_video(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Note whether the demonstration changes the answers of a policy that asks for its frames."""
    name = "video"
    if not _can_compare(player) or player.needs.demonstration_frames == "none":
        return
    if _changes_with_video(player, name, player.needs.cameras, STATE_FIELDS):
        yield CheckResult(name, PASS, "Another video leads to other actions.")
    else:
        yield CheckResult(
            name,
            NOTE,
            "Another video leads to the same actions, bit for bit; if the policy needs no video, "
            'demonstration_frames = "none" saves time; otherwise the video is lost on the way.',
        )


def _can_compare(player: PolicyPlayer) -> bool:
    return player.repeatable and not player.constant


def _not_checked(player: PolicyPlayer, name: str) -> Iterator[CheckResult]:
    if not player.constant:  # which is said already
        yield CheckResult(name, NOTE, "Not checked: equal episodes differ.")


def _changes(
    player: PolicyPlayer, check: str, *, instruction: str = SECOND, fields: Sequence[str] = ()
) -> bool:
    """Return whether the answers change with the words, or with fields of all observations."""
    first = player.make_episodes(changed=fields).episode(instruction, VIDEO_STEPS).first
    episode = player.with_video._replace(instruction=instruction, first=first)
    return not are_equal(player.expected, player.play(check, episode, changed=fields))


def _changes_with_video(
    player: PolicyPlayer, check: str, cameras: Sequence[str], fields: Sequence[str] = ()
) -> bool:
    """Return whether the answers change with the video's pictures of cameras, and its fields."""
    changed = (*fields, *(f"{camera}_rgb" for camera in cameras))
    other = player.make_episodes(changed=changed).episode(SECOND, VIDEO_STEPS)
    episode = player.with_video._replace(demonstration=other.demonstration)
    return not are_equal(player.expected, player.play(check, episode))


def _reads_end(player: PolicyPlayer, remarks: int, ends: Sequence[str] = _ENDS) -> bool:
    """Return whether the end changes the answers, behind a number of words of remarks."""
    one, other = (
        player.play("prompt end", _episode(player, _long_prompt(remarks, end))) for end in ends
    )
    return not are_equal(one, other)


def _long_prompt(remarks: int, end: str) -> str:
    return " ".join([*_REMARKS.split()[:remarks], end])


def _episode(player: PolicyPlayer, instruction: str) -> SyntheticEpisode:
    return player.make_episodes().episode(instruction, 0)


def check_order(player: PolicyPlayer) -> Iterator[CheckResult]:
    """Check that implicit words lead to the same actions before and after explicit ones."""
    name = "order of words"
    if not player.repeatable:
        return
    episode = get_episode("PickXtimes", "train", 0)
    words = {name: language.instruct(episode, name).text for name in ACCEPTANCE_SETTINGS}
    # Nothing can remember this scene, not even a server that was checked before.
    scene = SyntheticEpisodes(player.needs, secrets.randbits(32)).episode("", VIDEO_STEPS)
    explicit = scene._replace(instruction=words.pop(EXPLICIT))
    implicit = [scene._replace(instruction=text) for text in words.values()]
    before = [player.play(name, one) for one in implicit]
    player.play(name, explicit)
    for one, first in zip(implicit, before, strict=True):
        after = player.play(name, one)
        if not are_equal(first, after):
            yield CheckResult(
                name,
                FAIL,
                f"{one.instruction!r} leads to other actions once {explicit.instruction!r} was "
                f"heard in the same scene (by up to {describe_difference(first, after)}): results "
                "of implicit instructions depend on the order of play. Keep nothing of an "
                "episode in the module, the class, files or the server.",
            )
            return
    yield CheckResult(name, PASS, "Implicit words mean the same before and after explicit ones.")
