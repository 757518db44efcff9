"""Plans: which episodes to play, checked before anything starts.

A job is one episode that one policy plays. Here a job without a policy stands for an instruction:
what is said of a scene in one setting.
"""

from __future__ import annotations

import functools
import itertools
from collections import Counter
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import replace

import msgspec

from roboirg import tasks
from roboirg.core.arms import TOLD
from roboirg.core.delivery import TURNS
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.field_types import check_policy_name
from roboirg.core.instruction_options import DEFAULT_FRAME, InstructionOptions
from roboirg.core.policy_ref import PolicyRef
from roboirg.language.generator import check_options, find_refusal
from roboirg.language.settings import (
    EXPLICIT,
    SETTING_GROUPS,
    all_settings,
    check_named_settings,
    find_settings,
    settings_of,
)
from roboirg.policies.by_name.key_variables import check_variables
from roboirg.records.record import Job, Summary
from roboirg.records.record_codec import identity_key
from roboirg.runs.hosting.policy_opening import open_policy
from roboirg.runs.job_instruction import instruct_job
from roboirg.runs.plan.option_parsing import Names
from roboirg.runs.plan.plan_fields import PlanFields
from roboirg.tasks.splits import splits
from roboirg.tasks.splits.private_splits import MissingSaltError, is_private


class Plan(PlanFields):
    """Which policies play which episodes, with which instructions."""

    @property
    def _has_groups(self) -> bool:
        """Whether a word such as ``all`` stands for settings; an episode may then lack some."""
        return not SETTING_GROUPS.keys().isdisjoint(self.settings)

    def checked(self) -> Plan:
        """Return this plan, completed, if all of it can be played; else raise.

        Added are the versions and needs of its policies, for which each is opened, and which words
        its instructions have.

        Raises:
            UnknownNameError: a policy, task, setting, … does not exist; the message suggests the
                nearest.
            InvalidValueError: a number is out of range, or a task lacks a setting.
        """
        self._check_options()
        self._check_scenes()
        instructions = list(self._instructions_to_check())
        if not instructions:
            raise InvalidValueError(
                f"There is nothing to play: {', '.join(self.settings)} cannot express any of "
                "these episodes."
            )
        words = set()
        for job in instructions:
            instruction = instruct_job(job)  # raises if the options cannot express the episode
            words.add(str(instruction.metadata["words"]))

        check_variables(self.hosting.policy_env, "policies")
        # Each of the user's policies is opened in a process of its own, wherever it plays later.
        host_settings = replace(self.hosting, policy_process="own").settings
        time_limit = self.hosting.policy_timeout_s
        opened = [open_policy(policy, time_limit, host_settings) for policy in self.policies]
        found = {"policies": tuple(opened), "words": tuple(sorted(words))}
        return self.model_copy(update=found)

    def _check_options(self) -> None:
        """Raise if a name or an option is wrong, as far as that can be seen without episodes."""
        tasks.find_tasks(self.tasks)
        find_settings(self.settings)
        _check_policy_names(self.policies)
        for form, stages in itertools.product(self.forms, self.stages):
            check_options(replace(self.instruction, form=form, stages=stages))
        self.environment.check()
        if self.stop is not None and self.arms != (TOLD,):
            raise InvalidValueError(
                "A run that stops when it is decided compares episodes in their own words; leave "
                f"arms out, or stop (arms are {', '.join(self.arms)})."
            )
        # Only in settings that use the option `delivery` can utterances come one after another.
        in_turns = [name for name, rule in all_settings().items() if "delivery" in rule.reads]
        check_names("setting in turns", self.in_turns, in_turns)
        if is_private(self.split) and self.hosting.policy_process == "shared":
            raise InvalidValueError(
                "policy_process is 'shared', so policies would know the salt of private episodes; "
                "it must be 'own'."
            )

    def _check_scenes(self) -> None:
        """Raise if the split lacks an episode, or a task has no setting of a name that is given."""
        for task in self.tasks:
            # If the first and the last exist, so do all between them.
            for episode in (min(self.episodes), max(self.episodes)):
                splits.get_episode(task, self.split, episode)
        check_named_settings(self.settings, self.tasks)

    def jobs(self, played: Iterable[Summary] = ()) -> tuple[Job, ...]:
        """Return every job, ordered by policy, task, episode, setting, form, stages and seed.

        In each scene, instructions that state the goal outright come last: a policy that remembers
        earlier episodes must not know the goal when it gets the others.

        Args:
            played: stored results, to save time: their instructions need no check that the setting
                can express them.
        """
        said = {
            (result.task, result.episode, result.setting)
            for result in played
            if result.split == self.split
        }

        # What can be said of an episode is slow to find, so all policies share it.
        instructions: list[Job] = []
        for task in self.tasks:
            for episode in self.episodes:
                instructions += self._instructions(task, episode, said)
        jobs: list[Job] = []
        for policy in self.policies:
            for instruction in instructions:
                jobs += self._trials(policy, instruction)
        return tuple(jobs)

    def left_out(self, jobs: Iterable[Job]) -> Mapping[str, int]:
        """Return how many jobs each control arm lacks, because its words cannot be made.

        For example ``{"other-goal": 4}`` if 4 scenes have no second goal. Arms that lack none are
        left out.

        Args:
            jobs: of this plan.
        """
        # Jobs that differ only in the arm are one trial: as if they were of the usual arm, they
        # have equal keys.
        counts: Counter[str] = Counter()
        trials = set()
        for job in jobs:
            counts[job.arm] += 1
            trials.add(identity_key(msgspec.structs.replace(job, arm=TOLD)))
        total = len(trials)
        return {arm: total - counts[arm] for arm in self.arms if counts[arm] < total}

    def drawable_jobs(self, played: Iterable[Summary] = ()) -> tuple[Job, ...]:
        """Return the jobs that this computer can make, to count what a stored run lacks.

        There are none if the episodes are private and the salt that they are drawn with is not
        known. Tasks and settings whose package is not installed are left out.

        Args:
            played: results of the run, as in `jobs`.
        """
        try:
            splits.check_split(self.split)
        except MissingSaltError:
            return ()
        known_tasks = tasks.every_task()
        known_settings = {*all_settings(), *SETTING_GROUPS}
        found_tasks = tuple(name for name in self.tasks if name in known_tasks)
        found_settings = tuple(name for name in self.settings if name in known_settings)
        installed = {"tasks": found_tasks, "settings": found_settings}
        return self.model_copy(update=installed).jobs(played)

    def settings_of(
        self, task: str, episode: int, said: Collection[tuple[str, int, str]] = ()
    ) -> Names:
        """Return the settings in which an episode is played.

        If the plan names settings, these are all. If it has a group such as ``all``, they are those
        that the task has and that can express the episode.

        Args:
            task: name of its task.
            episode: its position in the split.
            said: task, episode and setting of instructions that are known to be possible.
        """
        if not self._has_groups:
            return self.setting_names
        chosen = self.setting_names
        playable = []
        for setting in settings_of(tasks.get_task(task)):
            if setting not in chosen:
                continue
            # Explicit is kept unchecked: a task without words should be refused, not left out.
            is_sure = setting == EXPLICIT or (task, episode, setting) in said
            if is_sure or self._refusal(task, episode, InstructionOptions(setting)) is None:
                playable.append(setting)
        return tuple(playable)

    def _instructions(
        self, task: str, episode: int, said: Collection[tuple[str, int, str]] = ()
    ) -> Iterator[Job]:
        """Yield a job for each instruction that an episode is played with; it names no policy yet.

        Instructions that state the goal outright come last.

        Args:
            task: name of its task.
            episode: its position in the split.
            said: as in `settings_of`.
        """
        variants: list[InstructionOptions] = []
        for setting in self.settings_of(task, episode, said):
            variants += self._options_of(setting)
        variants.sort(key=_states_goal)  # False comes before True
        for options in variants:
            if self._is_left_out(task, episode, options):
                continue
            yield Job(
                policy="",
                task=task,
                split=self.split,
                episode=episode,
                options=replace(options, wordings=self.wordings and self.wordings.identity),
                wordings_file=self.wordings and self.wordings.file,
                environment=self.environment,
            )

    def _trials(self, policy: PolicyRef, instruction: Job) -> Iterator[Job]:
        """Yield the jobs of a policy with an instruction, one for each control arm and seed.

        Arms whose words cannot be made from the instruction are left out.

        Args:
            policy: that plays.
            instruction: a job without a policy.
        """
        for arm in self.arms:
            if arm != TOLD and not _has_arm(instruction, arm):
                continue
            for seed in self.policy_seeds:
                # Copying is faster than making, and there may be very many.
                yield msgspec.structs.replace(
                    instruction, policy=policy.name, ref=policy, policy_seed=seed, arm=arm
                )

    def _options_of(self, setting: str) -> Iterator[InstructionOptions]:
        """Yield the options of each instruction that is played in a setting.

        There is one for each form and set of stages of the plan, and for settings in `in_turns` the
        same once more with utterances one after another. Options that do not change the words of
        the setting (those not in its `reads`) keep their defaults, so that no two jobs have the
        same words.
        """
        rule = all_settings()[setting]
        usual = InstructionOptions(setting)
        # Only an implicit goal can be said in several forms, and only some settings have stages.
        forms = self.forms if rule.implicit else (usual.form,)
        stage_sets = self.stages if "stages" in rule.reads else (usual.stages,)
        chosen = {option: getattr(self.instruction, option) for option in rule.reads - {"stages"}}
        for form, stages in itertools.product(forms, stage_sets):
            options = replace(usual, form=form, stages=stages, **chosen)
            yield options
            if setting in self.in_turns and options.delivery != TURNS:
                yield replace(options, delivery=TURNS)

    def _is_left_out(self, task: str, episode: int, options: InstructionOptions) -> bool:
        """Return whether the scene of an episode is too simple for an instruction.

        Some settings are harder versions of a *plain* one and need more of a scene, such as a
        second color. The answer is yes if only the plain one can express the episode; if neither
        can, that is an error, which is found later.
        """
        plain_setting = all_settings()[options.setting].plain
        if plain_setting is None:
            return False
        if self._refusal(task, episode, options) is None:
            return False
        return self._refusal(task, episode, replace(options, setting=plain_setting)) is None

    def _refusal(self, task: str, episode: int, options: InstructionOptions) -> str | None:
        """Return why an episode cannot be said with some options; None if it can."""
        return find_refusal(splits.get_episode(task, self.split, episode), options)

    def _instructions_to_check(self) -> Iterator[Job]:
        """Yield a job for each instruction of which `checked` must see that it can be said."""
        episodes = self.episodes
        has_usual_words = self.instruction.frame == DEFAULT_FRAME and self.wordings is None
        if self._has_groups and has_usual_words:
            # Settings of a group are played only where they can express the episode, so the first
            # episode of each task is enough.
            episodes = episodes[:1]
        for task in self.tasks:
            for episode in episodes:
                yield from self._instructions(task, episode)


def _check_policy_names(policies: Iterable[PolicyRef]) -> None:
    """Raise if a policy's name is not fit for records, or two policies have the same name."""
    specs: dict[str, str] = {}
    for policy in policies:
        check_policy_name(policy.name)
        spec = specs.setdefault(policy.name, policy.spec)
        if spec != policy.spec:
            raise InvalidValueError(
                f"Two policies are named {policy.name!r}: {spec} and {policy.spec}."
            )


def _states_goal(options: InstructionOptions) -> bool:
    """Return whether an instruction says outright what to do, so that it is played last."""
    return options.setting == EXPLICIT or options.form == "resolved"


@functools.lru_cache(maxsize=65_536)
def _has_arm(job: Job, arm: str) -> bool:
    """Return whether words of a control arm can be made from an instruction.

    Args:
        job: the instruction, a job without a policy.
        arm: name of the arm.
    """
    try:
        instruct_job(msgspec.structs.replace(job, arm=arm))
    except InvalidValueError:
        return False
    return True
