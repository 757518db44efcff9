"""Does a policy keep the contract? Made-up episodes tell, without a simulator."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import ActionSpace, check_chunk
from roboirg.core.errors import MissingDependencyError, RoboIRGError
from roboirg.policies.base import Policy
from roboirg.policies.loading import make_policy
from roboirg.policies.requirements import (
    wanted_actions,
    wanted_cameras,
    wanted_demonstration_frames,
    wanted_history,
)
from roboirg.policies.synthetic_episodes import SyntheticEpisode, SyntheticEpisodes

if TYPE_CHECKING:
    from rich.console import Console

Verdict = Literal["pass", "fail", "note"]
PASS: Verdict = "pass"  # noqa: S105 - a verdict
FAIL: Verdict = "fail"
NOTE: Verdict = "note"

VIDEO_STEPS = 40
CALLS = 3
"""Calls of `act` in a made-up episode."""
_FIRST, _SECOND = "Put the red cube on the target.", "Press the second button from the left."
_LONGEST_WORDS = 300


class CheckResult(NamedTuple):
    """One thing that was looked at.

    Attributes:
        what: in a few words.
        verdict: pass, fail, or note for what is allowed and good to know.
        sentence: what was found.
    """

    what: str
    verdict: Verdict
    sentence: str


class _Broken(Exception):  # noqa: N818 - never leaves this file
    """The check cannot go on; the argument says why."""


class _Course(NamedTuple):
    """What a policy did in a made-up episode."""

    chunks: list[NDArray[np.float64]]
    seconds: list[float]
    dtype: str


def check_policy(policy: str | Policy, *, seed: int = 0) -> list[CheckResult]:
    """Try a policy on made-up episodes.

    Args:
        policy: a spec as for `roboirg.policies.make_policy`, or an object, which is then reset
            where a spec gives a fresh one.
        seed: of the policy and of what is made up.

    Returns:
        What was found, in the order in which it was looked at; later checks need earlier ones.

    Raises:
        MissingDependencyError: something has to be installed first.
    """
    findings: list[CheckResult] = []
    try:
        _Check(policy, seed, findings).run()
    except _Broken as broken:
        findings.append(CheckResult(*broken.args))
    return findings


def print_check_results(findings: list[CheckResult], console: Console) -> None:
    """A table of what was found, and how many failed."""
    from rich.table import Table

    styles = {PASS: "green", FAIL: "bold red", NOTE: "yellow"}
    table = Table(box=None, pad_edge=False)
    for heading in ("check", "", "finding"):
        table.add_column(heading)
    for finding in findings:
        table.add_row(
            finding.what, f"[{styles[finding.verdict]}]{finding.verdict}[/]", finding.sentence
        )
    console.print(table, highlight=False)
    failed = sum(finding.verdict == FAIL for finding in findings)
    console.print(f"{failed} of {len(findings)} checks failed." if failed else "All is well.")


class _Check:
    """One run of all checks."""

    def __init__(self, policy: str | Policy, seed: int, findings: list[CheckResult]) -> None:
        self._given, self._seed, self._findings = policy, seed, findings
        self._open: Policy | None = None

    def run(self) -> None:
        """Look at one thing after the other."""
        try:
            policy = self._load()
            self._look(policy)
            plain = self._episode(_FIRST, 0)
            course = self._chunks("without a video", plain)
            self._time(course)
            shown = self._episode(_SECOND, VIDEO_STEPS)
            again = self._chunks("with a video", shown)
            self._inputs(shown)
            self._same(policy, shown, again)
            self._forgets(policy, plain, shown, again)
            self._garbage(plain)
        finally:
            self._close()

    def _note(self, what: str, verdict: Verdict, sentence: str) -> None:
        self._findings.append(CheckResult(what, verdict, sentence))

    def _load(self) -> Policy:
        try:
            policy = self._fresh()
            lacking = [name for name in ("reset", "act") if not callable(getattr(policy, name, 0))]
        except MissingDependencyError:
            raise
        except Exception as error:  # the policy's own code runs here
            raise _Broken("loads", FAIL, _words(error)) from error
        if lacking:
            raise _Broken("loads", FAIL, f"It has no {lacking[0]}().")
        if hasattr(policy, "attach"):
            raise _Broken(
                "loads", NOTE, "It looks behind the scenes of a world; there is none here."
            )
        self._note("loads", PASS, f"{type(policy).__name__} was made with seed {self._seed}.")
        return policy

    def _look(self, policy: Policy) -> None:
        try:
            self._space: ActionSpace = wanted_actions(policy)
            cameras, frames = wanted_cameras(policy), wanted_demonstration_frames(policy)
            every = wanted_history(policy)
        except RoboIRGError as error:
            raise _Broken("asks for", FAIL, str(error)) from error
        self._studio: Callable[[], SyntheticEpisodes] = lambda: SyntheticEpisodes(
            cameras, frames, every, self._seed
        )
        self._note(
            "asks for",
            PASS,
            f"Actions {self._space.name}, cameras {', '.join(cameras) or 'none'}, demonstration "
            f"frames {frames}, observations every {every or 'chunk'}.",
        )

    def _chunks(self, when: str, episode: SyntheticEpisode) -> _Course:
        course = self._play(f"acts {when}", episode)
        sizes = [len(chunk) for chunk in course.chunks]
        outside = sum(
            int(((chunk < self._space.low) | (chunk > self._space.high)).any(axis=1).sum())
            for chunk in course.chunks
        )
        told = f"{', '.join(map(str, sizes))} actions of {self._space.size} numbers, {course.dtype}"
        self._note(f"acts {when}", PASS, f"Chunks of {told}, all finite.")
        if outside:
            self._note(
                f"range {when}",
                NOTE,
                f"{outside} of {sum(sizes)} actions have a number outside the usual range of "
                f"{self._space.name}; they are executed as far as the robot can.",
            )
        return course

    def _time(self, course: _Course) -> None:
        steps = sum(map(len, course.chunks))
        first, *others = course.seconds
        self._note(
            "time",
            NOTE,
            f"The first call took {1000 * first:.1f} ms, later ones {1000 * np.mean(others):.1f} "
            f"ms; {1000 * sum(course.seconds) / steps:.2f} ms per action.",
        )

    def _inputs(self, episode: SyntheticEpisode) -> None:
        given = copy.deepcopy(episode)
        self._play_as_it_is("leaves its inputs alone", given)
        changed = _difference(
            (episode.demonstration, episode.first), (given.demonstration, given.first)
        )
        if changed:
            self._note("leaves its inputs alone", FAIL, f"It changed {changed} in place.")
        else:
            self._note("leaves its inputs alone", PASS, "What it was given is as before.")

    def _same(self, policy: Policy, episode: SyntheticEpisode, before: _Course) -> None:
        what = "is the same with the same seed"
        again = self._play(what, episode)
        if _equal(before, again):
            self._note(what, PASS, "Two equal episodes have the same actions, bit for bit.")
        elif getattr(policy, "deterministic", True):
            self._note(
                what,
                FAIL,
                f"Two equal episodes differ by up to {_apart(before, again)}; a policy "
                "that cannot help it says deterministic = False.",
            )
        else:
            self._note(what, NOTE, "Equal episodes differ, as it says of itself.")

    def _forgets(
        self, policy: Policy, other: SyntheticEpisode, episode: SyntheticEpisode, before: _Course
    ) -> None:
        what = "reset forgets"
        if not getattr(policy, "deterministic", True):
            self._note(what, NOTE, "It says that it is not deterministic, so nothing can be told.")
            return
        self._play(what, other)
        after = self._play(what, episode, fresh=False)
        if _equal(before, after):
            self._note(what, PASS, "An episode is not changed by the one before it.")
        else:
            self._note(
                what,
                FAIL,
                "An episode after another one, with the same object, differs by up to "
                f"{_apart(before, after)} from a first one.",
            )

    def _garbage(self, episode: SyntheticEpisode) -> None:
        what, studio = "broken sensors", self._studio()
        policy = self._begin(what, episode)
        try:
            answer = check_chunk(policy.act(studio.garbage(episode)), self._space)
            sentence = f"NaN and noise: it gives {len(answer)} finite actions."
        except Exception as error:  # noqa: BLE001 - to complain is one of the right answers
            sentence = f"NaN and noise: it complains ({_words(error)})"
        self._close()
        self._play(what, episode)
        self._note(what, PASS, f"{sentence.rstrip('.')}; the next episode works.")

    def _episode(self, instruction: str, size: int) -> SyntheticEpisode:
        return self._studio().episode(instruction, size)

    def _play(self, what: str, episode: SyntheticEpisode, *, fresh: bool = True) -> _Course:
        """An episode of a few calls, on a copy that a policy may spoil."""
        return self._play_as_it_is(what, copy.deepcopy(episode), fresh=fresh)

    def _play_as_it_is(
        self, what: str, episode: SyntheticEpisode, *, fresh: bool = True
    ) -> _Course:
        """An episode of a few calls; what is seen in them depends on the seed alone."""
        policy = self._begin(what, episode, fresh=fresh)
        studio, observation = self._studio(), episode.first
        course = _Course([], [], "")
        for _ in range(CALLS):
            start = time.perf_counter()
            try:
                answer = policy.act(observation)
                seconds = time.perf_counter() - start
                chunk = check_chunk(answer, self._space)
            except Exception as error:
                raise _Broken(what, FAIL, f"act(): {_words(error)}") from error
            # A copy: a policy may use its array again.
            course.chunks.append(chunk.copy())
            course.seconds.append(seconds)
            course = course._replace(dtype=str(np.asarray(answer).dtype))
            observation = studio.after(episode, len(chunk))
        return course

    def _begin(self, what: str, episode: SyntheticEpisode, *, fresh: bool = True) -> Policy:
        try:
            policy = self._fresh() if fresh or self._open is None else self._open
            self._open = policy
            policy.reset(episode.instruction, episode.demonstration)
        except Exception as error:
            raise _Broken(what, FAIL, f"reset(): {_words(error)}") from error
        return policy

    def _fresh(self) -> Policy:
        self._close()
        return make_policy(self._given, self._seed) if isinstance(self._given, str) else self._given

    def _close(self) -> None:
        policy, self._open = self._open, None
        close = getattr(policy, "close", None)
        if callable(close):
            close()


def _equal(one: _Course, other: _Course) -> bool:
    return len(one.chunks) == len(other.chunks) and all(
        np.array_equal(first, second)
        for first, second in zip(one.chunks, other.chunks, strict=True)
    )


def _apart(one: _Course, other: _Course) -> str:
    """The largest difference of two courses, in words."""
    pairs = list(zip(one.chunks, other.chunks, strict=True))
    if any(first.shape != second.shape for first, second in pairs):
        return "the number of actions"
    return f"{max(float(np.abs(first - second).max()) for first, second in pairs):.3g}"


def _difference(before: Any, after: Any, name: str = "") -> str:  # noqa: ANN401 - any nest
    """The name of something that differs between two nests of containers and arrays."""
    if isinstance(before, np.ndarray):
        same = isinstance(after, np.ndarray) and np.array_equal(before, after)
        return "" if same else name
    if isinstance(before, dict):
        if not isinstance(after, dict) or list(before) != list(after):
            return name or "the names of its inputs"
        pairs = [(str(key), before[key], after[key]) for key in before]
    elif isinstance(before, tuple):
        pairs = [(name, one, other) for one, other in zip(before, after, strict=True)]
    else:
        return "" if before == after else name
    found = (_difference(one, other, key) for key, one, other in pairs)
    return next((word for word in found if word), "")


def _words(error: Exception) -> str:
    words = " ".join(str(error).split())
    if not isinstance(error, RoboIRGError):
        words = f"{type(error).__name__}: {words}"
    return words[:_LONGEST_WORDS].rstrip(": .") + "."
