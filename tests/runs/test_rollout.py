"""One episode with a fake world and a fake policy."""

import itertools
import re
from pathlib import Path
from types import SimpleNamespace

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
from roboirg.records.record import EventRecord, Job
from roboirg.records.record_codec import encode, read_record
from roboirg.runs.job_instruction import instruct_job
from roboirg.runs.play import rollout
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.runs.play.video_writer import VideoWriter

JOB = Job(
    policy="random",
    ref=read_policy("random"),
    task="PickXtimes",
    split="test",
    episode=2,
    options=InstructionOptions("direct"),
)


class FakeWorld:
    """Ends after `length` steps with `status`."""

    render_device = "none"
    due_stage = None
    episode = None
    session = SimpleNamespace(world=SimpleNamespace(facts=frozenset()))

    def __init__(self, length=5, status="success", cause=None):
        self.length = length
        self.status = status
        self.cause = cause
        self.instruction = instruct_job(JOB)
        self.steps = 0
        self.executed_actions = 0
        self.hook = None
        self.closed = False
        self.trouble = None

    @property
    def unwrapped(self):
        return self

    def set_frame_hook(self, hook, every=1):
        self.hook = hook

    def picture(self, camera):
        return np.full((256, 256, 3), 40 * self.steps + len(camera), np.uint8)

    def reset(self, seed=None):
        if self.hook:
            self.hook(self, True)
        first = {"step": 3, "kind": "still", "subject": "robot", "place": None, "holds": True}
        shown = {"joint_positions": np.zeros((3, 7))}
        return {}, {
            "demonstration": shown,
            "demonstration_source": "planned",
            "elapsed_steps": 4,
            "events": [first],
            "status": "ongoing",
            "heard": self.heard_until(0),
        }

    def step_chunk(self, actions):
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
            "heard": self.heard_until(self.steps),
        }
        return {}, 0.0, over and self.status != "timeout", over and self.status == "timeout", info

    attempts = ()

    def heard_until(self, step):
        """Return the utterances that were told since the last call, none in this world."""
        return []

    def end_state(self):
        return np.zeros(3), "paper"

    def close(self):
        self.closed = True


class FakePolicy:
    cameras = ()

    def __init__(self, answer=None):
        self.answer = np.zeros((3, 8)) if answer is None else answer
        self.heard = []

    def reset(self, instruction, demonstration):
        self.heard += [instruction, len(demonstration["joint_positions"])]

    def act(self, observation):
        if isinstance(self.answer, BaseException):
            raise self.answer
        return self.answer


class PolicyWithAttach(FakePolicy):
    def attach(self, env):
        self.heard.append(type(env).__name__)


@pytest.fixture
def give_world_and_policy(monkeypatch):
    """Return what sets the world and the policy of the next episode."""

    def give(world, policy):
        monkeypatch.setattr(rollout, "make_env", lambda _job, _needs: world)
        monkeypatch.setattr(rollout, "load_policy", lambda _job: policy)

    return give


@pytest.fixture
def record_of_episode(give_world_and_policy):
    def play(world, policy, job=JOB):
        give_world_and_policy(world, policy)
        return EpisodeRunner(Path()).play_once(job)[0]

    return play


def test_an_episode_ends_within_a_chunk_of_actions(record_of_episode):
    """The policy answers with 3 actions at a time, the world ends after 5: two calls, 3 + 2.

    *executed* is the most of a call, 3.
    """
    world = FakeWorld(length=5)

    record = record_of_episode(world, FakePolicy(np.zeros((3, 8))))

    assert (record.outcome, record.cause, record.steps) == ("success", None, 5)
    assert (record.calls, record.executed) == (2, 3)
    assert world.closed


def test_a_policys_reset_gets_the_instruction_and_the_video(record_of_episode):
    """The policy notes what its reset gets: the instruction, and how many frames the video before
    its turn has, which are 3 in the fake world. The record has their number, too."""
    policy = FakePolicy()

    record = record_of_episode(FakeWorld(), policy)

    assert policy.heard == [instruct_job(JOB).text, 3]
    assert record.demonstration_steps == 3


def test_events_before_the_policys_first_action_have_negative_steps(record_of_episode):
    """The world has taken 4 steps by then; *still* begins at its step 3, *picked* at 4 + 5."""
    record = record_of_episode(FakeWorld(length=5), FakePolicy())

    assert [(event.kind, event.step) for event in record.events] == [("still", -1), ("picked", 5)]


def test_a_plan_may_prescribe_the_frames_of_the_video(record_of_episode):
    """The plan asks for four frames of the video before the policy's turn. The record has this
    among the needs of the policy, with its cameras, of which it wants none."""
    job = replace(JOB, environment=EnvironmentOptions(demonstration_frames=4))

    needs = record_of_episode(FakeWorld(), FakePolicy(), job).needs

    assert (needs["demonstration_frames"], needs["cameras"]) == (4, [])


def test_a_policy_that_wants_other_actions_than_the_plan_prescribes_is_an_error(record_of_episode):
    """The policy answers with joint angles; the plan asks for poses of the hand."""
    job = replace(JOB, environment=EnvironmentOptions(actions="ee_pose"))

    record = record_of_episode(FakeWorld(), FakePolicy(), job)

    assert record.cause == (
        "policy: the policy's action space is 'joint_angle', but the plan requires 'ee_pose'."
    )


@pytest.mark.parametrize(("spec", "attached"), [("oracle", ["FakeWorld"]), ("random", [])])
def test_only_a_policy_that_is_declared_privileged_gets_the_world(
    record_of_episode, spec, attached
):
    """Of the policies of the benchmark `oracle` is declared as privileged, `random` is not.

    The policy that plays under that name notes the type of the world that it is given, if any, and
    after it what its reset gets: the instruction and a video, of which it notes the 3 frames.
    """
    policy = PolicyWithAttach()

    record_of_episode(FakeWorld(), policy, replace(JOB, policy=spec, ref=read_policy(spec)))

    assert policy.heard == [*attached, instruct_job(JOB).text, 3]


@pytest.mark.parametrize(
    ("status", "given", "outcome", "cause"),
    [
        ("failure", "picked the red cube", "failure", "picked the red cube"),
        ("timeout", None, "failure", "not done after 1300 steps"),
    ],
)
def test_the_outcome_and_its_cause_are_those_of_the_world(
    record_of_episode, status, given, outcome, cause
):
    """An episode may end as a failure with a cause that the world gives, or when its time is over,
    which is a failure, too: 1,300 steps are the usual limit."""
    record = record_of_episode(FakeWorld(3, status, given), FakePolicy())

    assert (record.outcome, record.cause) == (outcome, cause)


@pytest.mark.parametrize(
    ("answer", "cause"),
    [
        (ValueError("bad weights"), "policy: ValueError: bad weights"),
        (KeyError("<It at 0x7f3a12345678>\n \ud800"), "policy: KeyError: '<It at 0x…>"),
        (MotionPlanningError("no path to the cube"), "policy: no path to the cube"),
        (SystemExit(3), "policy: SystemExit: 3"),
        (np.zeros((0, 8)), "invalid action: .*shape"),
        (np.full((2, 8), np.nan), "invalid action: .*nan"),
        ("left", "invalid action: .*numbers"),
    ],
)
def test_a_policy_that_raises_or_answers_nonsense_ends_its_episode_as_an_error_not_a_failure(
    record_of_episode, answer, cause
):
    """The policy raises `answer`, if that is an exception, or answers with it instead of numbers
    for its joints. An error counts in no rate. Its cause has no address of memory, which differs
    each time."""
    world = FakeWorld()

    record = record_of_episode(world, FakePolicy(answer))

    assert record.outcome == "error"
    assert re.fullmatch(f"{cause}.*", record.cause)
    assert "Traceback" in record.details
    assert world.closed


@pytest.mark.parametrize(
    ("value", "stored"),
    [
        (np.str_("adam"), "adam"),
        (Path("a/b"), "a/b"),
        (np.eye(2), [[1.0, 0.0], [0.0, 1.0]]),
        ((np.bool_(True), {Path("x"): None}), [True, {"x": None}]),
        (np.zeros((9, 9)), "array of shape (9, 9), float64"),
    ],
    ids=str,
)
def test_metadata_of_a_policy_are_stored_as_json(record_of_episode, value, stored):
    """`value` is a part of what a policy says of itself, `stored` the same as a record has it.

    Large arrays are stored by their shape alone.
    """
    policy = FakePolicy()
    policy.metadata = {"deep": {"value": value}}

    record = record_of_episode(FakeWorld(), policy)

    assert record.policy_metadata == {"deep": {"value": stored}}
    assert read_record(encode(record), Path(), 1) == record


@pytest.mark.parametrize(
    ("value", "sentence"),
    [
        (np.float32("nan"), "'deep.value' is nan; it must be a text, a finite number"),
        ({"more": [0, b"x"]}, "'deep.value.more[1]' is b'x'; it must be"),
        ({(1, 2): 3}, "deep.value has the key (1, 2); keys must be text"),
    ],
    ids=str,
)
def test_metadata_that_json_cannot_hold_are_an_error_that_names_their_key(
    record_of_episode, value, sentence
):
    """The value stands in what the policy says of itself, its metadata, under the keys *deep* and
    *value*: no number, bytes, and a key that is no text."""
    policy = FakePolicy()
    policy.metadata = {"deep": {"value": value}}

    record = record_of_episode(FakeWorld(), policy)

    assert record.outcome == "error"
    assert record.cause.startswith(f"policy: the policy's metadata: {sentence}")


@pytest.mark.parametrize(
    ("trouble", "cause"),
    [
        (RuntimeError("physics\nexploded"), "environment: RuntimeError: physics exploded"),
        (InvalidActionError("got nan"), "invalid action: got nan"),
    ],
)
def test_an_exception_in_the_world_ends_the_episode_as_an_error_of_the_environment(
    record_of_episode, trouble, cause
):
    """The world raises `trouble` when it should act. The cause names it in one line, with this file
    and the line where it was raised; actions that are not valid have a kind of their own."""
    world = FakeWorld()
    world.trouble = trouble

    record = record_of_episode(world, FakePolicy())

    assert record.outcome == "error"
    assert record.cause.startswith(f"{cause} (test_rollout.py, line ")


@pytest.mark.parametrize("error", [RenderDeviceError("no"), MissingDependencyError("no")])
def test_missing_graphics_or_packages_stop_the_run_instead_of_one_episode(record_of_episode, error):
    """Every other episode would lack them, too, so the error is not written into a record."""
    with pytest.raises(type(error)):
        record_of_episode(FakeWorld(), FakePolicy(error))


def test_ctrl_c_in_a_policy_stops_the_run_and_is_no_error_of_the_episode(record_of_episode):
    """While the policy acts, Ctrl-C raises this in the process of the run."""
    with pytest.raises(KeyboardInterrupt):
        record_of_episode(FakeWorld(), FakePolicy(KeyboardInterrupt()))


@pytest.mark.parametrize(
    ("mode", "status", "kept"),
    [("all", "success", True), ("failures", "success", False), ("failures", "failure", True)],
)
def test_a_video_is_kept_of_all_episodes_or_of_failures_alone_as_asked(
    give_world_and_policy, tmp_path, mode, status, kept
):
    """`mode` says which videos are wanted, `status` how the world of five steps ended.

    A kept video has two files, the film and its title picture, and the record names the film.
    """
    give_world_and_policy(FakeWorld(5, status), FakePolicy())

    record = EpisodeRunner(tmp_path, mode)(JOB)

    assert (record.video == f"videos/{JOB.slug}.mp4") == kept
    assert (tmp_path / f"videos/{JOB.slug}.mp4").exists() == kept
    assert (tmp_path / f"videos/{JOB.slug}.jpg").exists() == kept


class FullDiskContainer:
    """A container that can be written to no longer, as on a full disk."""

    def mux(self, packets):
        raise OSError(28, "No space left on device")

    def close(self):
        raise OSError(28, "No space left on device")


@pytest.mark.parametrize("frame_number", [1, 3, 8])
def test_a_full_disk_costs_the_video_but_not_the_verdict(
    give_world_and_policy, monkeypatch, tmp_path, frame_number
):
    """From a frame on nothing can be written.

    The container that the writer writes to is replaced by one that fails as a full disk does. The
    episode of five steps is won all the same; it has no video, and the record says why.
    """
    encode_frame = VideoWriter._encode
    frames = itertools.count()

    def encode_until_full(writer, frame):
        if next(frames) == frame_number:
            writer._video.container = FullDiskContainer()
        encode_frame(writer, frame)

    monkeypatch.setattr(VideoWriter, "_encode", encode_until_full)
    give_world_and_policy(FakeWorld(length=5), FakePolicy())

    record = EpisodeRunner(tmp_path, "all")(JOB)

    assert (record.outcome, record.steps, record.video) == ("success", 5, None)
    assert "No space left on device" in record.video_error
    assert not list(tmp_path.rglob("*.mp4"))


def test_a_record_has_the_reasoning_pattern_of_its_words_and_the_values_drawn_for_it():
    """In the setting *reasoning* the goal must be inferred, in one of some ways (patterns)."""
    record = make_record(JOB.with_options(setting="reasoning"), "success")

    assert record.metadata["pattern"]
    assert record.metadata["draws"]


@pytest.mark.parametrize(("policy", "privileged"), [("oracle", True), ("random", False)])
def test_a_record_says_whether_its_policy_knows_the_simulators_state(policy, privileged):
    """The oracle knows the goal from it."""
    record = make_record(replace(JOB, policy=policy, ref=read_policy(policy)), "success")

    assert record.privileged == privileged


@pytest.mark.parametrize(
    ("setting", "frame", "failure"),
    [
        ("spatial", "robot", "mirrored_pick"),
        ("spatial", "camera", "mirrored_pick"),
        ("direct", "robot", "wrong_object"),
    ],
)
def test_a_wrong_cube_on_the_other_side_is_named_mirrored_if_the_words_named_a_side(
    setting, frame, failure
):
    """The words may count sides from the robot or from the camera; direct ones name none.

    Would find left and right mixed up in one of the frames, or a guess without a side.
    """
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


class RepeatsItsSubgoal(FakePolicy):
    """Names the same subgoal again, however its last try ended; one try ends before each call."""

    reports = True
    subgoal = "go"
    all_endings = (
        SubgoalEnd("go", "time-out", "time-out!"),
        SubgoalEnd("go", "missed", "missed!"),
        SubgoalEnd("go", "blocked", "blocked!"),
        SubgoalEnd("go", "done"),
        SubgoalEnd("sing", "refused", "no", "cube"),
    )

    def __init__(self):
        super().__init__()
        self.calls = itertools.count()

    @property
    def endings(self):
        return self.all_endings[: next(self.calls)]


def test_a_repeated_subgoal_is_noted_again_only_if_its_last_try_had_failed(record_of_episode):
    """The policy is asked every 3 steps and names the subgoal "go" each time. Before each call but
    the first, one more try at a subgoal has ended: those at "go" with a time-out, missed, blocked,
    and done; the last one, at "sing", was refused.

    After each failed try "go" is noted anew, at steps 0, 3, 6 and 9. The one from step 9 on is
    done, so that no new note is made at step 12. At step 15 the refused one is noted, and "go".
    """
    subgoals = record_of_episode(FakeWorld(length=30), RepeatsItsSubgoal()).subgoals

    assert [(subgoal.step, subgoal.text, subgoal.ended) for subgoal in subgoals] == [
        (0, "go", "time-out"),
        (3, "go", "missed"),
        (6, "go", "blocked"),
        (9, "go", "done"),
        (15, "sing", "refused"),
        (15, "go", None),
    ]


def test_a_subgoal_is_noted_with_why_its_try_failed_and_with_which_thing(record_of_episode):
    """Of five tries at subgoals the first ended with "time-out!" and no thing, the last with "no"
    and the cube; a subgoal whose try has not ended is noted after it."""
    subgoals = record_of_episode(FakeWorld(length=30), RepeatsItsSubgoal()).subgoals

    timed_out, *_, refused, _under_way = subgoals
    assert (timed_out.why, timed_out.thing) == ("time-out!", None)
    assert (refused.why, refused.thing) == ("no", "cube")


class SpeakingWorld(FakeWorld):
    """Tells its utterances at given steps; what comes after the last step is never told."""

    def __init__(self, steps, length):
        super().__init__(length)
        job = JOB.with_options(setting="contextual")
        self.instruction = instruct_job(job)
        self.told = list(zip(self.instruction.turns, steps, strict=False))

    def heard_until(self, step):
        fresh = [{"text": text, "step": at} for text, at in self.told if at <= step]
        del self.told[: len(fresh)]
        return fresh


class NotesWhatItHears(FakePolicy):
    """Writes down what it hears; its metadata are how many notes it has."""

    def hear(self, text, step):
        self.heard.append((text, step))

    @property
    def metadata(self):
        return {"notes": len(self.heard)}


JOB_IN_TURNS = JOB.with_options(setting="contextual", delivery="turns")


@pytest.mark.parametrize("policy_class", [FakePolicy, NotesWhatItHears])
def test_a_record_has_the_step_at_which_each_utterance_was_heard(policy_class, record_of_episode):
    """Four of five utterances come at steps 0, 3, 6 and 6 of ten; the fifth never (None).

    The record has them whether the policy has a method hear() or not.
    """
    world = SpeakingWorld((0, 3, 6, 6), length=10)

    record = record_of_episode(world, policy_class(), JOB_IN_TURNS)

    assert record.outcome == "success"
    assert [turn.text for turn in record.instruction] == list(world.instruction.turns)
    assert [turn.step for turn in record.instruction] == [0, 3, 6, 6, None]
    assert read_record(encode(record), Path(), 1) == record


def test_a_policy_hears_the_first_utterance_in_its_reset_and_the_others_with_their_steps(
    record_of_episode,
):
    """Utterances are due at steps 0, 3, 6 and 6 of an episode of ten steps.

    The policy notes what it gets: in its reset the first utterance and a demonstration, of which it
    notes the number of frames, 3; then each later utterance with its step. Its metadata are written
    after the last one: 2 + 3 notes.
    """
    world = SpeakingWorld((0, 3, 6, 6), length=10)
    policy = NotesWhatItHears()

    record = record_of_episode(world, policy, JOB_IN_TURNS)

    first, second, third, fourth, _never = world.instruction.turns
    assert policy.heard == [first, 3, (second, 3), (third, 6), (fourth, 6)]
    assert record.policy_metadata == {"notes": 2 + 3}


def test_a_policy_without_a_method_hear_gets_the_first_utterance_alone(record_of_episode):
    """Utterances are due at steps 0, 3, 6 and 6 of an episode of ten steps.

    The policy notes what it gets in its reset: the first utterance and a demonstration, of which it
    notes the number of frames, 3. There is no way to tell it the others.
    """
    world = SpeakingWorld((0, 3, 6, 6), length=10)
    policy = FakePolicy()

    record_of_episode(world, policy, JOB_IN_TURNS)

    assert policy.heard == [world.instruction.turns[0], 3]


def test_the_caption_of_a_video_grows_with_each_utterance(give_world_and_policy, tmp_path):
    """Utterances are due at steps 0, 3, 6, 6 and 9 of an episode of 11 steps, and the policy acts
    for 3 steps at a time. The caption of a frame is all that was said before its step.

    The video begins with a frame of the demonstration; it has one before the first step and one
    after each step. So 1 + 1 + 3 frames show one utterance, 3 (after steps 4 to 6) show two, 3 show
    four, as two came at step 6, and the 2 after step 9 show all five. Room is kept for these.
    """
    world = SpeakingWorld((0, 3, 6, 6, 9), length=11)
    captions = []

    class NotesCaptions(VideoWriter):
        def add_frame(self, source, is_demonstration=False):
            captions.append(self.caption)

    give_world_and_policy(world, FakePolicy())
    writer = NotesCaptions(tmp_path / "x.mp4")
    EpisodeRunner(tmp_path).play_once(JOB_IN_TURNS, writer)

    utterances_shown = 5 * [1] + 3 * [2] + 3 * [4] + 2 * [5]
    assert captions == [" ".join(world.instruction.turns[:count]) for count in utterances_shown]
    assert writer.longest_caption == world.instruction.text
