"""What an export holds: episodes, words, formats and pictures."""

from __future__ import annotations

import hashlib
import itertools
import json
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Literal, NamedTuple, get_args

from roboirg.apps.demonstrations.export_format import ExportFormat, find_format, names_where
from roboirg.apps.demonstrations.picture_coding import PictureCoding
from roboirg.apps.demonstrations.trajectory import SUFFIX, TRAJECTORY_VERSION
from roboirg.apps.demonstrations.trajectory_recorder import RecordingSpec
from roboirg.core.episode import ENVIRONMENT_VERSION, Episode
from roboirg.core.errors import InvalidValueError, known_name
from roboirg.core.field_types import check_whole
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.observations import CAMERAS, PICTURE_SIZE, check_cameras
from roboirg.core.word_pools import PoolName, pool_of
from roboirg.language.generator import instruct_with
from roboirg.language.instruction_row import row
from roboirg.language.scenarios.identity import language_label
from roboirg.language.settings import all_settings
from roboirg.language.variants import instructions
from roboirg.tasks.splits.splits import get_episode
from roboirg.util.short_hash import short_hash

Outcomes = Literal["successes", "all"]

ORACLE = "oracle"
SMALLEST = 16
"""Width and height of the smallest pictures that are exported, pixels."""


@dataclass(frozen=True)
class ExportPlan:
    """What is exported.

    Attributes:
        tasks: names, in order.
        split: of the episodes.
        episodes: positions in the split.
        settings: names.
        forms: implicit, resolved or both.
        options: all other options of the words.
        format: of the dataset.
        pictures: how they are stored.
        cameras: whose pictures are stored.
        size: width and height of the pictures, pixels.
        video: whether the frames of the video come before the policy's.
        variations: disturbed trajectories per episode.
        policy: who moves the robot.
        outcomes: whether failures are exported too.
        actions: the action space, and what a frame is: a control step, or a waypoint.
        disturbed: whether the oracle is disturbed on its way.
        language: whether frames have LeRobot's language columns.
    """

    tasks: tuple[str, ...]
    split: str
    episodes: tuple[int, ...]
    settings: tuple[str, ...]
    forms: tuple[str, ...] = ("implicit",)
    options: InstructionOptions = InstructionOptions()  # noqa: RUF009 - immutable
    format: str = "lerobot-v3"
    pictures: PictureCoding = "png"
    cameras: tuple[str, ...] = CAMERAS
    size: int = PICTURE_SIZE
    video: bool = False
    variations: int = 1
    policy: str = ORACLE
    outcomes: Outcomes = "successes"
    actions: Literal["joint_angle", "waypoint"] = "joint_angle"
    disturbed: bool = False
    language: bool = False

    def validated(self) -> ExportPlan:
        """Return this plan if its values are known and go together.

        Raises:
            UnknownNameError: a name does not exist.
            InvalidValueError: a value or a combination is not possible.
        """
        find_format(self.format)
        known_name("way to store pictures", self.pictures, get_args(PictureCoding))
        check_whole("variations", self.variations)
        if self.variations > 1 and not self.disturbed:
            raise InvalidValueError(
                f"variations is {self.variations}, but only disturbed demonstrations vary; ask for "
                "`disturbed: true`."
            )
        if self.language and not self.file_format.has_language:
            able = names_where(lambda known: known.has_language)
            raise InvalidValueError(f"language is true: such columns have the format {able}.")
        self._check_disturbed()
        self._check_waypoints()
        self._check_pictures()
        return self

    def _check_disturbed(self) -> None:
        """Check what disturbed demonstrations need; undisturbed ones always pass.

        In a disturbed one the expert is led off its way and comes back. Both the executed and the
        right action of each step are stored, for which the format must have room (labels).

        Raises:
            InvalidValueError: it has not, or the policy is not the oracle.
        """
        if self.disturbed and (self.policy != ORACLE or not self.file_format.has_labels):
            unlabeled = names_where(lambda known: not known.has_labels)
            raise InvalidValueError(
                f"disturbed is true, the policy {self.policy!r} and the format {self.format!r}: "
                f"only the oracle is disturbed, and a time step of {unlabeled} is the "
                "result of its action, so it has no place for one that was not executed."
            )

    def _check_waypoints(self) -> None:
        """Check what frames that are waypoints need; frames that are control steps always pass.

        Raises:
            InvalidValueError: the format has no such frames, or the video is to be included.
        """
        if self.actions == "waypoint" and (self.video or not self.file_format.has_waypoints):
            able = names_where(lambda known: known.has_waypoints)
            raise InvalidValueError(
                f"actions is 'waypoint': such frames have the format {able}, and "
                "none is of the video."
            )

    def _check_pictures(self) -> None:
        """Check the cameras and the size of pictures, also against what the format needs.

        RoboMME's format and openpi need both cameras in full size; what has depth needs PNG.

        Raises:
            InvalidValueError: a value or a combination is not possible.
        """
        check_cameras(self.cameras)
        if not self.cameras:
            raise InvalidValueError("cameras is empty; without pictures, ask for --pictures none.")
        if self.size % 2 or not SMALLEST <= self.size <= PICTURE_SIZE:
            raise InvalidValueError(
                f"size is {self.size}; it must be an even number from {SMALLEST} to {PICTURE_SIZE}."
            )
        is_whole = set(self.cameras) == set(CAMERAS) and self.size == PICTURE_SIZE
        if not is_whole and (self.file_format.has_depth or self.is_for_openpi):
            raise InvalidValueError(
                f"cameras is {', '.join(self.cameras)} and size {self.size}; RoboMME's format and "
                f"openpi have both cameras in {PICTURE_SIZE} pixels."
            )
        if self.file_format.has_depth and self.pictures != "png":
            raise InvalidValueError(
                f"The format {self.format!r} holds lossless pictures; it has no {self.pictures!r}."
            )

    @property
    def file_format(self) -> ExportFormat:
        """The format: what it can carry, and its functions."""
        return find_format(self.format)

    @property
    def is_for_openpi(self) -> bool:
        """Whether the features have openpi's names: it alone reads tables of this format."""
        return self.file_format.is_for_openpi and self.pictures == "png"

    @property
    def recording(self) -> RecordingSpec:
        """What the trajectories must hold."""
        return RecordingSpec(
            coding=self.pictures,
            video=self.video,
            depth=self.file_format.has_depth,
            cameras=self.cameras,
            size=self.size,
            actions=self.actions,
            disturbed=self.disturbed,
        )

    @property
    def pool(self) -> PoolName:
        """The pool that its words are taken from."""
        return pool_of(self.split, self.options.wordings)

    @property
    def language_label(self) -> str:
        """The version of the language, and which words of each task it has."""
        return language_label(self.tasks, self.pool, self.settings, self.options.wordings)

    def fingerprint(self) -> str:
        """Return a hash (SHA-256, hexadecimal) of everything that determines the dataset.

        A stopped export is only continued with the same one.
        """
        versions = [self.language_label, ENVIRONMENT_VERSION, TRAJECTORY_VERSION]
        return hashlib.sha256(json.dumps([asdict(self), versions]).encode()).hexdigest()


class ExportedInstruction(NamedTuple):
    """One instruction of an episode.

    Attributes:
        options: that select it.
        text: the prompt.
        facts: of the instruction, as a row of `roboirg export instructions`.
    """

    options: InstructionOptions
    text: str
    facts: dict[str, Any]


@dataclass(frozen=True)
class RecordingJob:
    """One trajectory to record.

    Attributes:
        task: name of the task.
        split: of the episode.
        number: of the episode.
        variation: number of the variation.
        policy: who moves the robot.
        options: of its instruction; None for the oracle, whose way the words do not change.
        spec: what the trajectory holds.
    """

    task: str
    split: str
    number: int
    variation: int
    policy: str
    options: InstructionOptions | None
    spec: RecordingSpec

    @property
    def episode(self) -> Episode:
        return get_episode(self.task, self.split, self.number)

    def path(self, folder: Path) -> Path:
        """Return the path of the trajectory's file, whose name has all that it depends on.

        For example ``PickXtimes-train-00003-000-png.zip``. Exports that keep trajectories in one
        folder share the files of equal names.
        """
        name = f"{self.task}-{self.split}-{self.number:05d}-{self.variation:03d}"
        if self.options is not None:
            name += f"-{short_hash(self.policy)}-{self.options.setting}-{self.options.form}"
            usual = InstructionOptions(self.options.setting, self.options.form)
            if self.options != usual:
                name += f"-{short_hash(repr(self.options))}"
        return folder / f"{'-'.join([name, *self._spec_words()])}{SUFFIX}"

    def _spec_words(self) -> list[str]:
        """Return the words of the file's name for what it holds: ``["png", "video", "front"]``.

        What is usual, such as all cameras, is left out. The order is fixed: kept files are found by
        it.
        """
        spec = self.spec
        words: list[str] = [spec.coding]
        if spec.video:
            words.append("video")
        if spec.depth:
            words.append("depth")
        if spec.cameras != CAMERAS:
            words += spec.cameras
        if spec.size != PICTURE_SIZE:
            words.append(str(spec.size))
        if spec.actions != ExportPlan.actions:
            words.append(spec.actions)
        if spec.disturbed:
            words.append("disturbed")
        return words


class SpokenJob(NamedTuple):
    """A trajectory to record, and the instructions with which it is exported."""

    job: RecordingJob
    instructions: tuple[ExportedInstruction, ...]


def training_words(split: str, options: InstructionOptions) -> InstructionOptions:
    """Return options whose words are for training, unless they name their words.

    Options without `wordings`, split ``"test"`` -> the same with ``wordings="train"``. For train
    and val, these are the words of the split anyway.
    """
    if options.wordings is None and pool_of(split) != "train":
        return replace(options, wordings="train")
    return options


def recording_jobs(plan: ExportPlan) -> list[SpokenJob]:
    """Return what is to be recorded: trajectories with their instructions, in the dataset's order.

    Task by task, episode by episode; the dataset's numbers follow this order.

    Raises:
        InvalidValueError: no setting can express any of the episodes.
    """
    jobs: list[SpokenJob] = []
    for task, index in itertools.product(plan.tasks, plan.episodes):
        jobs += _jobs_of(plan, get_episode(task, plan.split, index))
    if not jobs:
        raise InvalidValueError(f"None of these tasks has the setting {', '.join(plan.settings)}.")
    return jobs


def _jobs_of(plan: ExportPlan, episode: Episode) -> list[SpokenJob]:
    """Return the trajectories to record of an episode, each with the instructions that it serves.

    The oracle, which knows the goal, moves in the same way whatever is said: one trajectory serves
    all instructions, or each of several variations does. Any other policy is recorded once for each
    instruction, and does not vary. No instruction -> no trajectory.
    """
    exported = _instructions_of(plan, episode)
    if not exported:
        return []
    job = RecordingJob(
        task=episode.task,
        split=episode.split,
        number=episode.index,
        variation=0,
        policy=plan.policy,
        options=None,
        spec=plan.recording,
    )
    if plan.policy != ORACLE:
        return [SpokenJob(replace(job, options=text.options), (text,)) for text in exported]
    variations = range(plan.variations)
    return [SpokenJob(replace(job, variation=number), exported) for number in variations]


def _instructions_of(plan: ExportPlan, episode: Episode) -> tuple[ExportedInstruction, ...]:
    """Return the instructions of an episode in all settings and forms of the plan.

    Settings that cannot express the episode have none. An explicit instruction points back at
    nothing, so its implicit form is also its resolved form and is not given twice.
    """
    explicit_options = InstructionOptions(wordings=plan.options.wordings)
    explicit = instruct_with(episode, explicit_options).text
    exported = []
    found = instructions([episode], plan.settings, plan.forms, plan.options)
    for _, instruction in found:
        is_explicit = not all_settings()[instruction.setting].implicit
        is_resolved = instruction.form == "resolved" and "implicit" in plan.forms
        if is_explicit and is_resolved:
            continue
        options = replace(plan.options, setting=instruction.setting, form=instruction.form)
        facts = row(episode, instruction) | {"explicit": explicit}  # columns of the facts' table
        exported.append(ExportedInstruction(options, instruction.text, facts))
    return tuple(exported)
