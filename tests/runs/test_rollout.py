"""One episode against a world and a policy made of paper."""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from made_records import make_record
from msgspec.structs import replace

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.errors import (
    InvalidActionError,
    MissingDependencyError,
    MotionPlanningError,
    RenderDeviceError,
)
from roboirg.core.instruction_options import InstructionOptions
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.records.record import EventRecord, Job, Record
from roboirg.records.record_codec import encode, read_record
from roboirg.runs.job_instruction import instruct_job
from roboirg.runs.play import rollout
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.runs.play.video_writer import VideoWriter

SetUp = Callable[..., None]
Stage = Callable[..., Record]
JOB = Job(
    policy="random",
    ref=read_policy("random"),
    task="PickXtimes",
    split="test",
    episode=2,
    options=InstructionOptions("direct"),
)


class PaperWorld:
    """Ends after `length` steps with `status`."""

    render_device = "none"
    due_stage = None
    episode = None
    session = SimpleNamespace(world=SimpleNamespace(facts=frozenset()))

    def __init__(self, length: int = 5, status: str = "success", cause: str | None = None) -> None:
        self.length = length
        self.status = status
        self.cause = cause
        self.instruction = instruct_job(JOB)
        self.steps = 0
        self.executed_actions = 0
        self.hook: Callable[[Any, bool], None] | None = None
        self.closed = False
        self.trouble: Exception | None = None

    @property
    def unwrapped(self) -> PaperWorld:
        return self

    def set_frame_hook(self, hook: Callable[[Any, bool], None], every: int = 1) -> None:
        del every
        self.hook = hook

    def picture(self, camera: str) -> np.ndarray:
        return np.full((256, 256, 3), 40 * self.steps + len(camera), np.uint8)

    def reset(self, seed: int | None = None) -> tuple[dict[str, Any], dict[str, Any]]:
        del seed
        if self.hook:
            self.hook(self, True)
        first = {"step": 3, "kind": "still", "subject": "robot", "place": None, "holds": True}
        shown = {"joint_positions": np.zeros((3, 7))}
        info = {"demonstration": shown, "elapsed_steps": 4, "events": [first]}
        now = {"status": "ongoing", "heard": []}
        return {}, {**info, **now, "demonstration_source": "planned"}

    def step_chunk(self, actions: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        assert actions.shape[1:] == (8,)
        if self.trouble:
            raise self.trouble
        for _ in actions[: self.length - self.steps]:
            self.steps += 1
            self.executed_actions += 1
            if self.hook:
                self.hook(self, False)
        over = self.steps == self.length
        event = {"step": 4 + self.steps, "kind": "picked", "subject": "cube", "place": None}
        info = {
            "status": self.status if over else "ongoing",
            "cause": self.cause if over else None,
            "steps": self.steps,
            "events": [{**event, "holds": True}] if over else [],
            "heard": [],
        }
        return {}, 0.0, over and self.status != "timeout", over and self.status == "timeout", info

    attempts = ()

    def end_state(self) -> tuple[np.ndarray, str]:
        return np.zeros(3), "paper"

    def close(self) -> None:
        self.closed = True


class PaperPolicy:
    cameras = ()

    def __init__(self, answer: Any = None) -> None:
        self.answer = np.zeros((3, 8)) if answer is None else answer
        self.heard: list[Any] = []

    def reset(self, instruction: str, demonstration: Any) -> None:
        self.heard += [instruction, len(demonstration["joint_positions"])]

    def act(self, observation: Any) -> Any:
        del observation
        if isinstance(self.answer, BaseException):
            raise self.answer
        return self.answer


class PaperInsider(PaperPolicy):
    def attach(self, env: Any) -> None:
        self.heard.append(type(env).__name__)


@pytest.fixture
def set_up(monkeypatch: pytest.MonkeyPatch) -> SetUp:
    """Return what sets the world and the policy of the next episode."""

    def give(world: PaperWorld, policy: Any) -> None:
        monkeypatch.setattr(rollout, "make_env", lambda _job, _needs: world)
        monkeypatch.setattr(rollout, "load_policy", lambda _job: policy)

    return give


@pytest.fixture
def stage(set_up: SetUp) -> Stage:
    def play(world: PaperWorld, policy: Any, job: Job = JOB) -> Record:
        set_up(world, policy)
        return EpisodeRunner(Path()).play_once(job)[0]

    return play


def test_all_rows_are_played_until_the_end(stage):
    policy = PaperPolicy()
    world = PaperWorld(length=5)

    course = stage(world, policy)

    assert (course.outcome, course.cause, course.steps) == ("success", None, 5)
    assert (course.calls, course.executed) == (2, 3)
    assert course.demonstration_steps == 3
    assert [event.step for event in course.events] == [-1, 5]
    assert course.render_device is None
    assert policy.heard == [instruct_job(JOB).text, 3]
    assert world.closed


def test_a_record_holds_what_the_job_prescribes_instead_of_the_policy(stage):
    job = replace(JOB, environment=EnvironmentOptions(demonstration_frames=4))
    needs = stage(PaperWorld(), PaperPolicy(), job).needs
    assert (needs["demonstration_frames"], needs["cameras"]) == (4, [])

    job = replace(JOB, environment=EnvironmentOptions(actions="ee_pose"))
    assert stage(PaperWorld(), PaperPolicy(), job).cause == (
        "policy: the policy's action space is 'joint_angle', but the plan requires 'ee_pose'."
    )


@pytest.mark.parametrize(("spec", "attached"), [("oracle", ["PaperWorld"]), ("random", [])])
def test_a_policy_that_is_declared_privileged_is_attached_before_reset(stage, spec, attached):
    policy = PaperInsider()
    stage(PaperWorld(), policy, replace(JOB, policy=spec, ref=read_policy(spec)))
    assert policy.heard == [*attached, instruct_job(JOB).text, 3]


@pytest.mark.parametrize(
    ("status", "given", "outcome", "cause"),
    [
        ("failure", "picked the red cube", "failure", "picked the red cube"),
        ("timeout", None, "failure", "not done after 1300 steps"),
    ],
)
def test_the_judge_decides(stage, status, given, outcome, cause):
    course = stage(PaperWorld(3, status, given), PaperPolicy())
    assert (course.outcome, course.cause) == (outcome, cause)


@pytest.mark.parametrize(
    ("answer", "cause"),
    [
        (ValueError("bad weights"), "policy: ValueError: bad weights"),
        (KeyError("<It at 0x7f3a12345678>\n \ud800"), "policy: KeyError: '<It at 0x…>"),
        (MotionPlanningError("no path to the cube"), "policy: no path to the cube"),
        (SystemExit(3), "policy: SystemExit: 3"),
        (np.zeros((2, 7)), "invalid action: .*shape"),
        (np.zeros((0, 8)), "invalid action: .*shape"),
        (np.full((2, 8), np.nan), "invalid action: .*nan"),
        ("left", "invalid action: .*numbers"),
    ],
)
def test_a_fault_of_the_policy_is_an_error_not_a_failure(stage, answer, cause):
    world = PaperWorld()
    course = stage(world, PaperPolicy(answer))

    assert course.outcome == "error"
    assert re.fullmatch(f"{cause}.*", str(course.cause))
    assert "Traceback" in str(course.details)
    assert world.closed


@pytest.mark.parametrize(
    ("value", "stored"),
    [
        (np.float32(0.5), 0.5),
        (np.str_("adam"), "adam"),
        (Path("a/b"), "a/b"),
        (np.eye(2), [[1.0, 0.0], [0.0, 1.0]]),
        ((np.bool_(True), {Path("x"): None}), [True, {"x": None}]),
        (np.zeros((9, 9)), "array of shape (9, 9), float64"),
        (np.float32("nan"), "'deep.value' is nan; it must be a text, a finite number"),
        ({"more": [0, b"x"]}, "'deep.value.more[1]' is b'x'; it must be"),
        ({(1, 2): 3}, "'deep.value' is (1, 2); it must be"),
    ],
    ids=str,
)
def test_metadata_become_json_or_one_sentence_that_names_the_key(stage, value, stored):
    policy = PaperPolicy()
    policy.metadata = {"deep": {"value": value}}  # type: ignore[attr-defined]

    record = stage(PaperWorld(), policy)

    if record.outcome == "success":
        assert record.policy_metadata == {"deep": {"value": stored}}
        assert read_record(encode(record), Path(), 1) == record
    else:
        assert str(record.cause).startswith(f"policy: the policy's metadata: {stored}")


@pytest.mark.parametrize(
    ("trouble", "cause"),
    [
        (RuntimeError("physics\nexploded"), "environment: RuntimeError: physics exploded"),
        (InvalidActionError("got nan"), "invalid action: got nan"),
    ],
)
def test_a_fault_of_the_world_is_an_error(stage, trouble, cause):
    world = PaperWorld()
    world.trouble = trouble

    course = stage(world, PaperPolicy())

    assert course.outcome == "error"
    assert str(course.cause).startswith(f"{cause} (test_rollout.py, line ")
    assert course.demonstration_steps == 3


@pytest.mark.parametrize("error", [RenderDeviceError("no"), MissingDependencyError("no")])
def test_what_ends_every_episode_ends_the_run(stage, error):
    with pytest.raises(type(error)):
        stage(PaperWorld(), PaperPolicy(error))


def test_ctrl_c_is_no_episode_error(stage):
    policy = PaperPolicy()
    policy.act = lambda _observation: (_ for _ in ()).throw(KeyboardInterrupt)  # type: ignore[method-assign]
    with pytest.raises(KeyboardInterrupt):
        stage(PaperWorld(), policy)


@pytest.mark.parametrize(
    ("mode", "status", "kept"),
    [("all", "success", True), ("failures", "success", False), ("failures", "failure", True)],
)
def test_videos_are_kept_as_asked(set_up, tmp_path, mode, status, kept):
    set_up(PaperWorld(5, status), PaperPolicy())
    record = EpisodeRunner(tmp_path, mode)(JOB)
    assert (record.video is not None) == kept

    files = sorted(path.suffix for path in tmp_path.rglob("*") if path.is_file())
    assert files == ([".jpg", ".mp4", ".npz"] if kept else [".npz"])
    assert record.video in (None, f"videos/{JOB.slug}.mp4")


class Broken:
    """A container that can be written to no longer, as on a full disk."""

    def mux(self, packets: object) -> None:
        raise OSError(28, "No space left on device")

    def close(self) -> None:
        raise OSError(28, "No space left on device")


@pytest.mark.parametrize("after", [1, 3, 8])
def test_a_video_that_cannot_be_written_does_not_change_the_verdict(
    set_up, monkeypatch, tmp_path, after
):
    real = VideoWriter._encode
    count = 0

    def add(writer: VideoWriter, frame: np.ndarray) -> None:
        nonlocal count
        if count == after:
            writer._video = writer._video._replace(container=Broken())  # type: ignore[union-attr]
        count += 1
        real(writer, frame)

    monkeypatch.setattr(VideoWriter, "_encode", add)
    set_up(PaperWorld(5), PaperPolicy())

    record = EpisodeRunner(tmp_path, "all")(JOB)

    assert (record.outcome, record.steps, record.video) == ("success", 5, None)
    assert "No space left on device" in str(record.video_error)
    assert {path.suffix for path in tmp_path.rglob("*") if path.is_file()} == {".npz"}


def test_a_record_says_what_is_in_the_words_and_who_cheats():
    job = replace(JOB.with_options(setting="reasoning"), policy="oracle", ref=read_policy("oracle"))
    record = make_record(job, "success")

    assert record.metadata["pattern"]
    assert record.metadata["draws"]
    assert record.privileged
    assert not make_record(JOB).privileged
    assert read_record(encode(record), Path(), 1) == record


@pytest.mark.parametrize(
    ("setting", "frame", "failure"),
    [
        ("spatial", "robot", "mirrored_pick"),
        ("spatial", "camera", "mirrored_pick"),
        ("direct", "robot", "wrong_object"),
    ],
)
def test_a_record_tells_a_mirrored_pick_where_the_words_name_a_side(setting, frame, failure):
    job = Job(
        policy="random",
        task="PickXtimes",
        split="test",
        episode=6,
        options=InstructionOptions(setting, frame=frame),
    )
    events = (EventRecord(step=9, kind="picked", subject="cube_red"),)

    record = make_record(job, "failure", "picked up the red cube", steps=9, events=events)

    assert (record.attribution.failure, record.attribution.subject) == (failure, "cube_red")


class Stubborn(PaperPolicy):
    """Names the same subgoal again, however its last try ended."""

    reports = True
    subgoal = "go"
    turns = itertools.count()

    @property
    def endings(self) -> list[SubgoalEnd]:
        failed = (SubgoalEnd("go", how, f"{how}!") for how in ("time-out", "missed", "blocked"))
        ends = [*failed, SubgoalEnd("go", "done"), SubgoalEnd("sing", "refused", "no", "cube")]
        return ends[: next(self.turns)]


def test_a_subgoal_is_noted_again_where_its_last_try_came_to_nothing(stage):
    found = stage(PaperWorld(30), Stubborn()).subgoals
    assert [
        (subgoal.step, subgoal.text, subgoal.ended, subgoal.why, subgoal.thing) for subgoal in found
    ] == [
        (0, "go", "time-out", "time-out!", None),
        (3, "go", "missed", "missed!", None),
        (6, "go", "blocked", "blocked!", None),
        (9, "go", "done", None, None),
        (15, "sing", "refused", "no", "cube"),
        (15, "go", None, None, None),
    ]


class TellingWorld(PaperWorld):
    """Tells its utterances at given steps; what comes after the last step is never told."""

    def __init__(self, steps: tuple[int, ...], length: int) -> None:
        super().__init__(length)
        job = JOB.with_options(setting="contextual")
        self.instruction = instruct_job(job)
        self.told = list(zip(self.instruction.turns, steps, strict=False))

    def reset(self, seed: int | None = None) -> tuple[dict[str, Any], dict[str, Any]]:
        observation, info = super().reset(seed)
        return observation, {**info, "heard": self._fresh(0)}

    def step_chunk(self, actions: np.ndarray) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        *others, info = super().step_chunk(actions)
        return *others, {**info, "heard": self._fresh(self.steps)}  # type: ignore[return-value]

    def _fresh(self, step: int) -> list[dict[str, Any]]:
        fresh = [{"text": text, "step": at} for text, at in self.told if at <= step]
        del self.told[: len(fresh)]
        return fresh


class Hearing(PaperPolicy):
    """Writes down what it hears; its metadata are what it has heard."""

    def hear(self, text: str, step: int) -> None:
        self.heard += [text, step]

    @property
    def metadata(self) -> dict[str, Any]:
        return {"heard": len(self.heard)}


TURNS = JOB.with_options(setting="contextual", delivery="turns")


@pytest.mark.parametrize("policy_class", [PaperPolicy, Hearing])
def test_a_record_holds_what_was_heard_when(policy_class, stage):
    world = TellingWorld((0, 3, 6, 6), length=10)
    policy = policy_class()

    record = stage(world, policy, TURNS)

    assert record.outcome == "success"
    turns = world.instruction.turns
    steps = [turn.step for turn in record.instruction]
    assert [turn.text for turn in record.instruction] == list(turns)
    assert steps == [0, 3, 6, 6, None]
    if policy_class is Hearing:
        assert policy.heard == [turns[0], 3, turns[1], 3, turns[2], 6, turns[3], 6]
        assert record.policy_metadata == {"heard": 8}
    else:
        assert policy.heard == [turns[0], 3]
        assert record.policy_metadata == {}
    assert read_record(encode(record), Path(), 1) == record


def test_the_caption_grows_as_utterances_are_heard(set_up, tmp_path):
    world = TellingWorld((0, 3, 6, 6, 9), length=11)
    captions: list[str] = []

    class Captions(VideoWriter):
        def add_frame(self, source: Any, is_demonstration: bool = False) -> None:
            del source, is_demonstration
            captions.append(self.caption)
            assert self.longest_caption == world.instruction.text

    set_up(world, PaperPolicy())
    EpisodeRunner(tmp_path).play_once(TURNS, Captions(tmp_path / "x.mp4"))

    counts = [1, 1, 1, 1, 1, 2, 2, 2, 4, 4, 4, 5, 5]  # video, first frame, chunks of 3
    assert captions == [" ".join(world.instruction.turns[:count]) for count in counts]
