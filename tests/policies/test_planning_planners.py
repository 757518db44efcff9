"""Planners in front of a policy: when they ask, what they show, and what comes of the answers."""

import base64
import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from planning_fakes import (
    CAPTURES,
    check_capture,
    check_sample,
    decoded,
    fake_vlm,
    golden,
    model_options,
    spent,
)

import roboirg
from roboirg.core.episode import Primitive
from roboirg.core.errors import InvalidValueError
from roboirg.policies import Policy, PrivilegedPolicy, make_policy, play
from roboirg.policies.contract.base import SubgoalEnd
from roboirg.policies.hands.scripted_hands import ScriptedHands
from roboirg.policies.planners import make_planner as make_by_kind
from roboirg.policies.planners import model_planners
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.policies.planners.oracle_planner import OraclePlanner
from roboirg.policies.planners.points import to_pixel
from roboirg.policies.vlm.models import ModelOptions

CHUNK = 16
REPLY = "pick up the red cube at <|box_start|>(500,250)<|box_end|>"
SUBGOAL = f"pick up the red cube at <{to_pixel(500)}, {to_pixel(250)}>"
KINDS = ("qwen", "gemini", "memer")
REPLY_OF = {
    "qwen": REPLY,
    "gemini": json.dumps({"description": "x", "subgoal_sequence": [], "subgoal":
                          "Pick up the red cube at <500, 250>"}),
    "memer": json.dumps({"current_subtask": REPLY, "keyframe_positions": []}),
}  # fmt: skip


class PolicyThatStandsStill:
    """Returns still actions, a given number of rows per chunk."""

    cameras = ()
    demonstration_frames = "none"
    observe_every = 3  # no planner has this period, and CHUNK is no multiple of it

    def __init__(self, rows=CHUNK):
        self.rows = rows
        self.told = []
        self.seen = []

    def reset(self, instruction, demonstration):
        self.shown = dict(demonstration)
        self.told = []

    def follow(self, subgoal):
        self.told.append(subgoal)

    def act(self, observation):
        self.seen.append(observation)
        return np.zeros((self.rows, 8))

    def usage(self):
        return {"calls": 1, "cost_usd": 0.5}

    metadata = {"checkpoint": "seven"}  # noqa: RUF012


def make_planner(kind, server, provider="openai", **more):
    own = {key: more.pop(key) for key in list(more) if key not in ModelOptions.model_fields}
    model = model_options(server, provider, **more)
    return make_by_kind(kind, {"model": model, **own}, "the test")


def observation_at(step, size=64):
    """What is seen at a step: its number as a shade of grey."""
    return {"front_rgb": np.full((size, size, 3), step % 256, np.uint8)}


def video(steps, size=64):
    return {
        "front_rgb": np.stack([observation_at(step, size)["front_rgb"] for step in range(steps)]),
        "joint_positions": np.zeros((steps, 7)),
    }


NO_VIDEO = {"front_rgb": np.zeros((0, 64, 64, 3), np.uint8), "joint_positions": np.zeros((0, 7))}


def play_in_chunks(
    planner, steps, chunk=CHUNK, demonstration=NO_VIDEO, instruction="Do it.", size=64
):
    """Play an episode in chunks with a policy that stands still, and return the whole policy.

    Observations come at each chunk's first step, with a history as often as the planner wants.
    """
    policy = HierarchicalPolicy(planner, PolicyThatStandsStill(chunk))
    policy.reset(instruction, demonstration)
    for step in range(0, steps + 1, chunk):
        observation = observation_at(step, size)
        if policy.observe_every is not None:
            history = []
            for past in range(max(step - chunk + 1, 1), step + 1):
                if past % policy.observe_every == 0:
                    history.append(observation_at(past, size))
            observation["history"] = tuple(history)
        policy.act(observation)
    return policy


def steps_asked(kind, reply, chunk=CHUNK, **options):
    """The steps, of 0 to 320, at which a planner asks; the policy plays `chunk` steps at a time."""
    asked = []
    with fake_vlm([reply]) as server:
        planner = make_planner(kind, server, **options)
        policy = HierarchicalPolicy(planner, PolicyThatStandsStill(chunk))
        policy.reset("Do it.", NO_VIDEO)
        for step in range(0, 321, chunk):
            before = len(server.requests)
            policy.act({**observation_at(step), "history": ()})
            asked += [step] * (len(server.requests) - before)
    return asked


def pictures(body):
    """The shades of all pictures in a request, in order."""
    shades = []
    for message in body["messages"][1:]:
        for part in message["content"] if isinstance(message["content"], list) else ():
            if part["type"] == "image_url":
                content = base64.b64decode(part["image_url"]["url"].partition(",")[2])
                shades.append(int(decoded(content)[0][0, 0, 0, 0]))
    return shades


def clip(body):
    """The frames of the last clip in a request to Google."""
    (part,) = [part for part in body["contents"][-1]["parts"] if "inlineData" in part]
    assert "video/mp4" in part["inlineData"].values()
    return decoded(base64.b64decode(part["inlineData"]["data"].replace("-", "+").replace("_", "/")))


@pytest.mark.parametrize(
    ("kind", "asked"),
    [("qwen", "each-chunk"), ("memer", "each-chunk"), ("qwen", "every 7 steps")],
)
def test_a_planner_asks_once_a_chunk_also_if_its_period_is_shorter(kind, asked):
    steps = steps_asked(kind, REPLY_OF[kind], chunk=80, asked=asked)

    assert steps == [0, 80, 160, 240, 320]


def test_a_planner_asks_at_the_first_chunk_of_each_period():
    """Chunks begin at 0, 16, 32, 48, …: the first one of the period from 40 on begins at 48."""
    asked = steps_asked("qwen", REPLY, chunk=16, asked="every 40 steps")

    assert asked == [0, 48, 80, 128, 160, 208, 240, 288, 320]


@pytest.mark.parametrize(
    ("subgoal", "asked_again"),
    [
        ("press the button at (3,4)", 100),  # held until step 90, which belongs to the hold
        ("press the first button", 110),  # until step 100
        ("press the second button", 260),  # until step 250
        ("press the button at (3,4) to stop", 10),  # another subgoal: not held
    ],
)
def test_the_qwen_planner_does_not_ask_while_it_holds_a_button_s_subgoal(subgoal, asked_again):
    """Its model names the same subgoal each time; chunks have ten steps."""
    asked = steps_asked("qwen", subgoal, chunk=10)

    assert asked == [0, *range(asked_again, 321, 10)]


@pytest.mark.parametrize(
    ("options", "steps"),
    [
        ({"first_pause": 0}, [0, 48, 96, 144, 192, 240, 288]),
        ({}, [0, 96, 144, 192, 240, 288]),
        ({"first_pause": 144}, [0, 144, 192, 240, 288]),
    ],
    ids=["no pause", "the usual one of 75 steps", "144 steps"],
)
def test_the_gemini_planner_asks_every_48_steps_after_its_first_pause(options, steps):
    assert steps_asked("gemini", REPLY_OF["gemini"], **options) == steps


@pytest.mark.parametrize("kind", KINDS)
def test_after_an_unreadable_reply_the_last_subgoal_stays_and_the_question_is_counted(kind):
    """Questions come at steps 0, 96 and 192; {} is unreadable, and each question has two tries."""
    with fake_vlm(["{}", "{}", REPLY_OF[kind], "{}", "{}"]) as server:
        planner = make_planner(kind, server)
        policy = play_in_chunks(planner, 192, chunk=96)

    assert policy.policy.told == [SUBGOAL, SUBGOAL]  # none at step 0
    usage = planner.usage()
    assert (usage["calls"], usage["unparsed"], usage["unreadable"]) == (5, 2, 1)


def test_a_planner_that_waits_for_a_subgoal_s_end_repeats_an_unreadable_question_five_times():
    """One readable question, then five unreadable ones of two tries each: 11 requests."""
    with fake_vlm([REPLY, "{}"]) as server:
        planner = make_planner("qwen", server, asked="when-done")
        planner.reset("Do it.", NO_VIDEO)
        assert planner.plan(observation_at(0), 0) == SUBGOAL

        planner.hear("Now.", 1)
        for step in range(CHUNK, 20 * CHUNK, CHUNK):
            planner.plan(observation_at(step), step)
        assert len(server.requests) == 11


def test_the_qwen_planner_sends_the_current_picture_alone_besides_the_video():
    """Pictures have their step as their shade of grey; the video of 60 frames is a clip."""
    with fake_vlm([REPLY]) as server:
        play_in_chunks(make_planner("qwen", server, video="mp4"), 48, demonstration=video(60))

    assert [pictures(body) for body in server.requests] == [[0], [16], [32], [48]]


def test_the_qwen_planner_sends_the_subgoals_so_far():
    """The same words at another place are not another subgoal."""
    here = "pick up the cube at <|box_start|>(500,250)<|box_end|>"
    there = "pick up the cube at <|box_start|>(700,250)<|box_end|>"
    with fake_vlm([here, there, "put it down", here]) as server:
        play_in_chunks(make_planner("qwen", server, video="mp4"), 48, demonstration=video(60))

    # A message has the video's words, the video, the instruction, then the subgoals.
    told = [body["messages"][1]["content"][3]["text"] for body in server.requests]
    assert "nothing has been done" in told[0]
    assert told[1:] == [
        f"Subgoals so far, in order: 1. {here}",
        f"Subgoals so far, in order: 1. {here}",
        f"Subgoals so far, in order: 1. {here}; 2. put it down",
    ]


@pytest.fixture(scope="module")
def three_turns():
    """Google's requests at steps 0, 96 and 144; every second frame is kept."""
    with fake_vlm([REPLY_OF["gemini"]]) as server:
        planner = make_planner("gemini", server, "google", sampling_fps=5, observe_every=2)
        play_in_chunks(planner, 144, demonstration=video(20))
    return server.requests


def test_the_gemini_planner_continues_one_conversation(three_turns):
    _, second, third = three_turns

    assert third["contents"][:3] == second["contents"]


def test_the_first_clip_of_the_gemini_planner_is_the_demonstration_and_the_first_frame(three_turns):
    """The demonstration has 20 frames, of a video at 15 a second."""
    frames, rate = clip(three_turns[0])

    assert (len(frames), rate) == (21, 15)


def test_the_gemini_planner_asks_google_to_sample_its_clip_at_the_given_rate(three_turns):
    parts = three_turns[0]["contents"][0]["parts"]

    assert {"fps": 5} in [part.get("videoMetadata") for part in parts]


def test_later_clips_of_the_gemini_planner_have_every_second_frame_since_the_turn_before(
    three_turns,
):
    """Pictures have their step as their shade of grey, which a video keeps to within 4."""
    _, second, third = three_turns
    shades = clip(second)[0][:, 0, 0, 0].astype(int)

    assert shades == pytest.approx(np.arange(2, 97, 2), abs=3)
    assert len(clip(third)[0]) == 24  # steps 98, 100, … 144


def test_the_gemini_planner_asks_for_the_demonstration_at_its_own_period():
    with fake_vlm([]) as server:
        planner = make_planner("gemini", server, observe_every=2)

    assert HierarchicalPolicy(planner, PolicyThatStandsStill()).demonstration_frames == 2


def test_the_gemini_planner_sends_pictures_to_a_service_that_takes_no_clips():
    with fake_vlm([REPLY_OF["gemini"]]) as server:
        options = {"asked": "every 3 steps", "first_pause": 0, "observe_every": 2}
        play_in_chunks(make_planner("gemini", server, **options), 6, chunk=3)
        assert [pictures(body) for body in server.requests] == [[0], [0, 3], [0, 3, 6]]


def test_the_gemini_planner_repeats_the_clip_after_an_unreadable_answer():
    """The frames since the last answer of use are sent once more."""
    answers = [REPLY_OF["gemini"], "?", "?", REPLY_OF["gemini"]]
    with fake_vlm(answers) as server:
        policy = play_in_chunks(make_planner("gemini", server, "google", first_pause=0), 96)
        assert "unreadable" not in policy.usage()  # the last reply was of use
        assert len(clip(server.requests[-1])[0]) == 96
        assert len(server.requests[-1]["contents"]) == 3


@pytest.mark.parametrize(
    ("kind", "shades"), [("qwen", [7, 9, 0]), ("gemini", [7, 0]), ("memer", [7, 9, 0])]
)
def test_planners_send_nothing_of_the_last_episode_in_the_next_one(kind, shades):
    """Neither words, video and pictures nor subgoals: the second video has the shades 7, 8, 9."""
    second_video = {name: frames[7:] for name, frames in video(10).items()}
    with fake_vlm([REPLY_OF[kind].replace("[]", "[1]")]) as server:
        planner = make_planner(kind, server, clip_frames=2)
        play_in_chunks(planner, 112, instruction="First.", demonstration=video(20))
        server.requests.clear()

        play_in_chunks(planner, 0, instruction="Second.", demonstration=second_video)

    (body,) = server.requests
    assert pictures(body) == shades
    assert not re.search("First|red cube at", json.dumps(body))
    assert planner.usage()["calls"] == 1


class Refusing(PolicyThatStandsStill):
    """Refuses every subgoal; a planner learns this, but not what the subgoal meant."""

    def settle(self):
        pass

    @property
    def endings(self):
        return [
            SubgoalEnd(words, "refused", "no", "cube", number)
            for number, words in enumerate(self.told)
        ]


@pytest.mark.parametrize("when", ["when-done", "every 99 steps"])
def test_a_planner_whose_subgoals_are_refused_asks_five_times_in_an_episode(when):
    """And five times more in the next one."""
    with fake_vlm([REPLY]) as server:
        policy = HierarchicalPolicy(make_planner("stateless", server, asked=when), Refusing())

        counts = []
        for _ in range(2):
            policy.reset("Do it.", NO_VIDEO)
            policy.act({**observation_at(0), "history": ()})
            policy.act({**observation_at(CHUNK), "history": ()})
            counts.append(len(server.requests))

    assert counts == [5, 10]


def test_a_planner_learns_that_a_subgoal_was_refused_and_not_what_it_meant():
    with fake_vlm([REPLY]) as server:
        planner = make_planner("stateless", server)
        policy = HierarchicalPolicy(planner, Refusing())
        policy.reset("Do it.", NO_VIDEO)

        policy.act({**observation_at(0), "history": ()})

    assert planner.ends[-1] == SubgoalEnd(SUBGOAL, "refused", "no")


@pytest.fixture
def planner_of_three_stages():
    """A planner that is about to name the first of three stages: 0 hover, 1 pick, 2 drop."""
    planner = make_policy("planner:listener", 3).planner
    planner._index = 0
    planner._retries = 0
    planner._decider.stages = [
        SimpleNamespace(primitive=Primitive(kind, "cube"))
        for kind in ("hover", "pick_cube", "drop_into")
    ]
    return planner


def test_a_failed_stage_is_repeated_from_its_pick_and_at_most_three_times(planner_of_three_stages):
    """A cube that was lost is picked up again. Stage 3 is past the last one: the fourth failure
    ends the planning."""
    next_stages = []
    for how in ("done", "missed", "done", "blocked", "done", "time-out", "done", "missed"):
        planner_of_three_stages.learn(SubgoalEnd("", how))
        next_stages.append(planner_of_three_stages._index)

    assert next_stages == [1, 1, 2, 1, 2, 1, 2, 3]


def test_a_refused_stage_ends_the_planning(planner_of_three_stages):
    """Stage 3 is past the last one."""
    planner_of_three_stages.learn(SubgoalEnd("", "refused"))

    assert planner_of_three_stages._index == 3


def test_a_planner_that_listens_guesses_by_the_seed_of_the_policy():
    policy = make_policy("planner:listener", 3)

    assert policy.planner._decider.seed == 3


@pytest.mark.parametrize("last", ["all tasks completed", "the task is complete", "it is done"])
def test_all_is_done_from_the_gemini_model_leaves_the_last_subgoal(last):
    """The model says so at step 96, after a subgoal at step 0."""
    done = json.dumps({"description": "x", "subgoal": last})
    with fake_vlm([REPLY_OF["gemini"], done]) as server:
        policy = play_in_chunks(make_planner("gemini", server), 96, chunk=96)

    assert policy.policy.told == [SUBGOAL, SUBGOAL]


def memer_reply(*positions):
    """Return a reply that names a subgoal, and the frames to keep by their position."""
    return json.dumps({"current_subtask": REPLY, "keyframe_positions": positions})


def test_the_memer_planner_sends_recent_frames_and_the_key_frames_it_chose():
    """Of every second frame since the last question; a frame has its step as its shade.

    It keeps 4 (the 2nd of *0, 2, 4, …*) and 16 (the 8th), then 18, which joins 16.
    """
    replies = [memer_reply(1), memer_reply(8, 2), memer_reply(1), memer_reply(), memer_reply(8)]
    with fake_vlm(replies) as server:
        planner = make_planner("memer", server)

        play_in_chunks(planner, 64)

    assert [pictures(body) for body in server.requests] == [
        [0],
        [0, 2, 4, 6, 8, 10, 12, 14, 16],
        [4, 16, 18, 20, 22, 24, 26, 28, 30, 32],
        [4, 18, 34, 36, 38, 40, 42, 44, 46, 48],
        [4, 18, 50, 52, 54, 56, 58, 60, 62, 64],
    ]
    assert list(planner.frames) == [4, 18, 64]


def test_the_policy_behind_a_memer_planner_sees_the_moments_of_its_own_period():
    """Every third, where the planner sees every second."""
    with fake_vlm([memer_reply()]) as server:
        policy = play_in_chunks(make_planner("memer", server), 32).policy

    shades = []
    for observation in policy.seen:
        shades += [int(past["front_rgb"][0, 0, 0]) for past in observation["history"]]
    assert shades == [3, 6, 9, 12, 15, 18, 21, 24, 27, 30]


@pytest.mark.parametrize("positions", [[0], [9], ["one"], [1.5], [True], "1", None])
def test_key_frame_positions_that_do_not_exist_make_a_memer_reply_unreadable(positions):
    with fake_vlm(
        [json.dumps({"current_subtask": REPLY, "keyframe_positions": positions})]
    ) as server:
        planner = make_planner("memer", server)
        play_in_chunks(planner, 16)

        assert planner.usage()["unparsed"] == 2
        assert planner.frames == {}


@pytest.mark.parametrize(("option", "kept"), [({"most": 2}, [66, 82]), ({"near": 16}, [82])])
def test_options_of_the_memer_planner_limit_the_key_frames_it_keeps(option, kept):
    """The newest of at most `most`; those within `near` steps are one.

    In each reply the model chooses the first of the frames that it sees, so 66 at step 80 and 82
    at step 96.
    """
    choose = json.dumps({"current_subtask": REPLY, "keyframe_positions": [1]})
    with fake_vlm([choose]) as server:
        planner = make_planner("memer", server, **option)
        play_in_chunks(planner, 96)
        assert list(planner.frames) == kept


@pytest.mark.parametrize("subgoals", ["simple", "grounded"])
@pytest.mark.parametrize(
    ("kind", "provider", "last_step"),
    [("qwen", "openai", 16), ("gemini", "google", 96), ("memer", "openai", 16)],
)
def test_requests_of_planners_are_equal_to_the_stored_ones(kind, provider, last_step, subgoals):
    """The first and the last request of an episode, in the folder captures/planning."""
    options = {"subgoals": subgoals, "video": "mp4", "max_output_tokens": 128}
    with fake_vlm([REPLY_OF[kind]]) as server:
        play_in_chunks(
            make_planner(kind, server, provider, **options), last_step,
            demonstration=video(60, 256), instruction="Put the red one into the bin.", size=256,
        )  # fmt: skip

    found = [golden(server.requests[0]), golden(server.requests[-1])]
    check_capture(f"planner-{kind}-{subgoals}", found)


def test_the_page_of_planners_shows_a_stored_request_and_a_reply():
    """It is the second request, which names the first subgoal."""
    _, request = json.loads((CAPTURES / "planner-qwen-grounded.json").read_text())
    check_sample("planners.md", request, REPLY)


def test_the_stateless_planner_labels_frames_of_the_video_and_of_the_past_with_their_steps(
    monkeypatch,
):
    """In its second question: of a video of 20 steps at most ten frames, then every 16th step."""
    labels = []

    def sheets_with_labels(frames, words):
        labels.append(words)
        return frames[:1]

    monkeypatch.setattr(model_planners, "contact_sheets", sheets_with_labels)
    with fake_vlm(["remain static"]) as server:
        planner = make_planner("stateless", server, asked="each-chunk")
        play_in_chunks(planner, 16, demonstration=video(20))

    of_video, past = labels[1:]
    assert of_video == ["1", "3", "5", "7", "9", "12", "14", "16", "18", "20"]
    assert past == ["16"]


def test_the_costs_of_planner_and_policy_are_summed():
    """Three questions to the planner's model and one call of the policy, at 0.5 US dollars.

    A question takes 100 tokens, at a dollar per million, and its reply 7.
    """
    with fake_vlm([REPLY]) as server:
        policy = play_in_chunks(make_planner("qwen", server, input_price=1.0), 32)

    assert spent(policy) == {
        "calls": 4,
        "input_tokens": 300,
        "output_tokens": 21,
        "unparsed": 0,
        "cost_usd": pytest.approx(0.5003),
    }


def test_a_planner_and_its_policy_form_a_policy_with_the_metadata_of_both():
    with fake_vlm([REPLY]) as server:
        policy = HierarchicalPolicy(make_planner("qwen", server), PolicyThatStandsStill())

    assert isinstance(policy, Policy)
    assert not isinstance(policy, PrivilegedPolicy)
    assert policy.metadata["policy"] == {"checkpoint": "seven"}
    assert policy.metadata["planner"]["model"]["model"] == "fake"


def test_the_oracle_planner_refuses_an_environment_without_pixel_positions():
    policy = HierarchicalPolicy(OraclePlanner(), PolicyThatStandsStill())
    assert isinstance(policy, PrivilegedPolicy)
    with pytest.raises(InvalidValueError, match="grounded=True"):
        policy.attach(roboirg.make("PickXtimes", cameras=()))


@pytest.mark.parametrize("kind", KINDS)
def test_a_planner_quotes_also_the_sentence_that_was_said_during_the_episode(kind):
    """*Take it.* is said after the second chunk."""
    with fake_vlm([REPLY_OF[kind]]) as server:
        policy = HierarchicalPolicy(make_planner(kind, server), PolicyThatStandsStill(CHUNK))
        policy.reset("This one is red.", NO_VIDEO)
        for step in range(0, 200, CHUNK):
            policy.act({**observation_at(step), "history": ()})
            if step == CHUNK:
                policy.hear("Take it.", step)

    first, *_, last = map(json.dumps, server.requests)
    assert "This one is red." in first
    assert "Take it." not in first
    assert last.count("This one is red. Take it.") == 1


class HandsThatDoNotReport:
    """The scripted hands without their reports of how subgoals end."""

    cameras = ()
    demonstration_frames = "none"

    def __init__(self):
        hands = ScriptedHands()
        self.attach = hands.attach
        self.reset = hands.reset
        self.follow = hands.follow
        self.act = hands.act


@pytest.mark.sim
def test_a_planner_moves_on_with_hands_that_do_not_report_the_end_of_a_subgoal():
    policy = HierarchicalPolicy(make_by_kind("listener", {}, "test"), HandsThatDoNotReport())
    env = roboirg.make("StopCube", setting="explicit", cameras=(), demonstration_frames="none")

    info = play(env, policy)

    assert not policy.reports
    assert info["status"] == "success"
