"""Check that a policy keeps the contract, on synthetic episodes and without a simulator."""

from __future__ import annotations

import copy
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from roboirg.core.actions import ActionSpace, check_chunk
from roboirg.core.errors import MissingDependencyError, RoboIRGError
from roboirg.core.printable import printable
from roboirg.policies.base import Policy, close_policy, tell_policy
from roboirg.policies.loading import make_policy, needs_host
from roboirg.policies.requirements import (
    wanted_actions,
    wanted_calibration,
    wanted_cameras,
    wanted_demonstration_frames,
    wanted_depth,
    wanted_history,
)
from roboirg.policies.synthetic_episodes import SyntheticEpisode, SyntheticEpisodes
from roboirg.policies.turn_check import largest_difference, play_in_turns
from roboirg.util.plurals import counted

if TYPE_CHECKING:
    from rich.console import Console

Verdict = Literal["pass", "fail", "note"]
PASS: Verdict = "pass"  # noqa: S105 - a verdict
FAIL: Verdict = "fail"
NOTE: Verdict = "note"

VIDEO_STEPS = 40
CALLS = 3
"""Calls of `act` in a synthetic episode."""
_FIRST, _SECOND = "Put the red cube on the target.", "Press the second button from the left."
_MAX_ERROR_LENGTH = 300


class CheckResult(NamedTuple):
    """The result of one check.

    Attributes:
        check: its name.
        verdict: pass, fail, or note for what is allowed but worth knowing.
        message: one sentence.
    """

    check: str
    verdict: Verdict
    message: str


class _CheckAbortedError(Exception):
    """The checks cannot go on; the arguments are those of the last `CheckResult`."""


class _SyntheticRollout(NamedTuple):
    """The policy's actions in a synthetic episode, and the time of each call."""

    chunks: list[NDArray[np.float64]]
    seconds: list[float]
    dtype: str


def check_policy(policy: str | Policy, *, seed: int = 0) -> list[CheckResult]:
    """Check a policy on synthetic episodes.

    Args:
        policy: a spec as for `roboirg.policies.make_policy`, or an object, which is reset wherever
            a spec would give a fresh object.
        seed: of the policy and of the synthetic episodes.

    Returns:
        The results in the order of the checks, which end at the first that makes others
        impossible.

    Raises:
        MissingDependencyError: a library that the policy needs is not installed.
    """
    results: list[CheckResult] = []
    try:
        _PolicyChecker(policy, seed, results).run()
    except _CheckAbortedError as error:
        results.append(CheckResult(*error.args))
    return results


def print_check_results(results: list[CheckResult], console: Console) -> None:
    """Print a table of results, and how many checks failed."""
    from rich.markup import escape
    from rich.table import Table

    styles = {PASS: "green", FAIL: "bold red", NOTE: "yellow"}
    table = Table(box=None, pad_edge=False)
    for heading in ("check", "", "result"):
        table.add_column(heading)
    for result in results:
        table.add_row(
            result.check,
            f"[{styles[result.verdict]}]{result.verdict}[/]",
            escape(printable(result.message)),
        )
    console.print(table, highlight=False)
    failed = sum(result.verdict == FAIL for result in results)
    checks = counted(len(results), "check")
    console.print(f"{failed} of {checks} failed." if failed else f"{checks}, none failed.")


class _PolicyChecker:
    """Runs all checks of one policy and appends their results."""

    def __init__(self, policy: str | Policy, seed: int, results: list[CheckResult]) -> None:
        self._source, self._seed, self._results = policy, seed, results
        self._policy: Policy | None = None

    def run(self) -> None:
        """Run the checks in order."""
        try:
            policy = self._load()
            self._check_requirements(policy)
            without_video = self._new_episode(_FIRST, 0)
            rollout = self._check_actions("without a video", without_video)
            self._report_times(rollout)
            with_video = self._new_episode(_SECOND, VIDEO_STEPS)
            expected = self._check_actions("with a video", with_video)
            self._check_inputs(with_video)
            self._check_determinism(policy, with_video, expected)
            self._check_reset(policy, without_video, with_video, expected)
            self._check_turns(policy, without_video, with_video)
            self._check_hearing(policy, without_video)
            self._check_broken_sensors(without_video)
        finally:
            self._close()

    def _add(self, check: str, verdict: Verdict, message: str) -> None:
        self._results.append(CheckResult(check, verdict, message))

    def _load(self) -> Policy:
        try:
            policy = self._make_fresh()
            missing = [name for name in ("reset", "act") if not callable(getattr(policy, name, 0))]
        except MissingDependencyError:
            raise
        except Exception as error:  # the policy's own code runs here
            raise _CheckAbortedError("loads", FAIL, _describe_error(error)) from error
        if missing:
            raise _CheckAbortedError("loads", FAIL, f"It has no {missing[0]}().")
        if hasattr(policy, "attach"):
            raise _CheckAbortedError(
                "loads", NOTE, "It is privileged: it needs a simulator, and there is none here."
            )
        self._add("loads", PASS, f"{type(policy).__name__} was made with seed {self._seed}.")
        return policy

    def _check_requirements(self, policy: Policy) -> None:
        try:
            self._space: ActionSpace = wanted_actions(policy)
            cameras, frames = wanted_cameras(policy), wanted_demonstration_frames(policy)
            every = wanted_history(policy)
            depth, calibration = wanted_depth(policy), wanted_calibration(policy)
        except RoboIRGError as error:
            raise _CheckAbortedError("requirements", FAIL, str(error)) from error
        self._make_episodes: Callable[[], SyntheticEpisodes] = lambda: SyntheticEpisodes(
            cameras, frames, every, self._seed, depth=depth, calibration=calibration
        )
        more = ", depth" * depth + ", calibration" * calibration
        self._add(
            "requirements",
            PASS,
            f"Actions {self._space.name}, cameras {', '.join(cameras) or 'none'}, demonstration "
            f"frames {frames}, observations every {every or 'chunk'}{more}.",
        )

    def _check_actions(self, when: str, episode: SyntheticEpisode) -> _SyntheticRollout:
        rollout = self._play(f"acts {when}", episode)
        sizes = [len(chunk) for chunk in rollout.chunks]
        outside = sum(
            int(((chunk < self._space.low) | (chunk > self._space.high)).any(axis=1).sum())
            for chunk in rollout.chunks
        )
        self._add(
            f"acts {when}",
            PASS,
            f"Chunks of {', '.join(map(str, sizes))} actions of {self._space.size} numbers, "
            f"{rollout.dtype}, all finite.",
        )
        if outside:
            self._add(
                f"range {when}",
                NOTE,
                f"{outside} of {counted(sum(sizes), 'action')} have a number outside the usual "
                f"range of {self._space.name}; the robot executes them as well as it can.",
            )
        return rollout

    def _report_times(self, rollout: _SyntheticRollout) -> None:
        steps = sum(map(len, rollout.chunks))
        first, *others = rollout.seconds
        self._add(
            "time",
            NOTE,
            f"The first call took {1000 * first:.1f} ms, later ones {1000 * np.mean(others):.1f} "
            f"ms; {1000 * sum(rollout.seconds) / steps:.2f} ms per action.",
        )

    def _check_inputs(self, episode: SyntheticEpisode) -> None:
        given = copy.deepcopy(episode)
        self._play_in_place("inputs unchanged", given)
        changed = _first_difference(
            (episode.demonstration, episode.first), (given.demonstration, given.first)
        )
        if changed:
            self._add("inputs unchanged", FAIL, f"It changed {changed} in place.")
        else:
            self._add("inputs unchanged", PASS, "Demonstration and observations are as before.")

    def _check_determinism(
        self, policy: Policy, episode: SyntheticEpisode, expected: _SyntheticRollout
    ) -> None:
        again = self._play("deterministic", episode)
        if _equal(expected, again):
            self._add(
                "deterministic", PASS, "Two equal episodes have the same actions, bit for bit."
            )
        elif getattr(policy, "deterministic", True):
            self._add(
                "deterministic",
                FAIL,
                f"Two equal episodes differ by up to {_largest_difference(expected, again)}; if "
                "that is intended, set deterministic = False.",
            )
        else:
            self._add("deterministic", NOTE, "Equal episodes differ, as the policy declares.")

    def _check_reset(
        self,
        policy: Policy,
        other: SyntheticEpisode,
        episode: SyntheticEpisode,
        expected: _SyntheticRollout,
    ) -> None:
        if not getattr(policy, "deterministic", True):
            self._add("reset forgets", NOTE, "Not checked: the policy is not deterministic.")
            return
        self._play("reset forgets", other)
        after = self._play("reset forgets", episode, fresh=False)
        if _equal(expected, after):
            self._add("reset forgets", PASS, "An episode does not depend on the one before it.")
        else:
            self._add(
                "reset forgets",
                FAIL,
                "A second episode with the same object differs by up to "
                f"{_largest_difference(expected, after)} from the same episode played first.",
            )

    def _check_turns(self, policy: Policy, *episodes: SyntheticEpisode) -> None:
        """Check what a host relies on: episodes that share a process do not change each other."""
        spec = self._source
        if not isinstance(spec, str) or not needs_host(spec):
            return
        if not getattr(policy, "deterministic", True):
            self._add("turns", NOTE, "Not checked: the policy is not deterministic.")
            return
        ways = [("turns", "in turns", "the object", False)]
        if hasattr(policy, "act_together"):
            ways.append(("batches", "together", "its state", True))
        for check, how, where, together in ways:
            try:
                alone = [play_in_turns(spec, self._seed, [one])[0] for one in episodes]
                shared = play_in_turns(spec, self._seed, episodes, together=together)
            except Exception as error:
                raise _CheckAbortedError(check, FAIL, _describe_error(error)) from error
            difference = largest_difference(alone, shared)
            if difference == 0:
                self._add(check, PASS, f"Two episodes {how} have the actions that each has alone.")
            else:
                self._add(
                    check,
                    FAIL,
                    f"Two episodes {how} differ by up to {difference:.3g} from each alone; what "
                    f"belongs to an episode must be in {where}, not in the module.",
                )

    def _check_hearing(self, policy: Policy, episode: SyntheticEpisode) -> None:
        if not hasattr(policy, "hear"):
            return
        policy = self._reset("hears", episode)
        try:
            tell_policy(policy, [{"text": _SECOND, "step": 1}])
            later = episode._replace(instruction=_SECOND)
            check_chunk(policy.act(self._make_episodes().after(later, 1)), self._space)
        except Exception as error:
            raise _CheckAbortedError("hears", FAIL, f"hear(): {_describe_error(error)}") from error
        self._add("hears", PASS, "It acts after a second utterance.")

    def _check_broken_sensors(self, episode: SyntheticEpisode) -> None:
        policy = self._reset("broken sensors", episode)
        try:
            actions = check_chunk(policy.act(self._make_episodes().broken(episode)), self._space)
            reaction = f"it gives {counted(len(actions), 'finite action')}"
        except Exception as error:  # noqa: BLE001 - to raise is one of the right reactions
            reaction = f"it raises ({_describe_error(error).rstrip('.')})"
        self._close()
        self._play("broken sensors", episode)
        self._add("broken sensors", PASS, f"NaN and noise: {reaction}; the next episode works.")

    def _new_episode(self, instruction: str, size: int) -> SyntheticEpisode:
        return self._make_episodes().episode(instruction, size)

    def _play(
        self, check: str, episode: SyntheticEpisode, *, fresh: bool = True
    ) -> _SyntheticRollout:
        """Play a copy of an episode, which the policy may change."""
        return self._play_in_place(check, copy.deepcopy(episode), fresh=fresh)

    def _play_in_place(
        self, check: str, episode: SyntheticEpisode, *, fresh: bool = True
    ) -> _SyntheticRollout:
        """Play some calls of an episode; the observations depend on the seed alone."""
        policy = self._reset(check, episode, fresh=fresh)
        episodes, observation = self._make_episodes(), episode.first
        rollout = _SyntheticRollout([], [], "")
        for _ in range(CALLS):
            start = time.perf_counter()
            try:
                actions = policy.act(observation)
                seconds = time.perf_counter() - start
                chunk = check_chunk(actions, self._space)
            except Exception as error:
                raise _CheckAbortedError(check, FAIL, f"act(): {_describe_error(error)}") from error
            # A copy: a policy may reuse its array.
            rollout.chunks.append(chunk.copy())
            rollout.seconds.append(seconds)
            rollout = rollout._replace(dtype=str(np.asarray(actions).dtype))
            observation = episodes.after(episode, len(chunk))
        return rollout

    def _reset(self, check: str, episode: SyntheticEpisode, *, fresh: bool = True) -> Policy:
        try:
            policy = self._make_fresh() if fresh or self._policy is None else self._policy
            self._policy = policy
            policy.reset(episode.instruction, episode.demonstration)
        except Exception as error:
            raise _CheckAbortedError(check, FAIL, f"reset(): {_describe_error(error)}") from error
        return policy

    def _make_fresh(self) -> Policy:
        self._close()
        source = self._source
        return make_policy(source, self._seed) if isinstance(source, str) else source

    def _close(self) -> None:
        policy, self._policy = self._policy, None
        close_policy(policy)


def _equal(one: _SyntheticRollout, other: _SyntheticRollout) -> bool:
    return len(one.chunks) == len(other.chunks) and all(
        np.array_equal(first, second)
        for first, second in zip(one.chunks, other.chunks, strict=True)
    )


def _largest_difference(one: _SyntheticRollout, other: _SyntheticRollout) -> str:
    """Return the largest difference of two rollouts, in words."""
    pairs = list(zip(one.chunks, other.chunks, strict=True))
    if any(first.shape != second.shape for first, second in pairs):
        return "the number of actions"
    return f"{max(float(np.abs(first - second).max()) for first, second in pairs):.3g}"


def _first_difference(before: Any, after: Any, name: str = "") -> str:  # noqa: ANN401 - any nest
    """Return the name of an entry in which two nests of containers and arrays differ, or ``""``."""
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
    found = (_first_difference(one, other, key) for key, one, other in pairs)
    return next((word for word in found if word), "")


def _describe_error(error: Exception) -> str:
    words = " ".join(str(error).split())
    if not isinstance(error, RoboIRGError):
        words = f"{type(error).__name__}: {words}"
    return words[:_MAX_ERROR_LENGTH].rstrip(": .") + "."
