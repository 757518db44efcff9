"""Planners in front of a policy: when they ask, what they show, and what comes of the answers."""

import base64
import json
import re
from types import SimpleNamespace

import numpy as np
import pytest
from planning_fakes import (
    CAPTURES,
    TOKENS,
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
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.policies.planners.oracle_planner import OraclePlanner
from roboirg.policies.planners.points import to_pixel
from roboirg.policies.planners.query_schedule import MOST_USELESS
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
    """Play an episode in chunks; return the subgoal at each chunk's first step."""
    policy = HierarchicalPolicy(planner, PolicyThatStandsStill(chunk))
    policy.reset(instruction, demonstration)
    every = policy.observe_every
    for step in range(0, steps + 1, chunk):
        observation = observation_at(step, size)
        if every is not None:
            observation["history"] = tuple(
                observation_at(at, size)
                for at in range(max(step - chunk + 1, 1), step + 1)
                if at % every == 0 and step
            )
        policy.act(observation)
    return policy


def asked_at(server, kind, answer, steps, chunk=CHUNK, **options):
    """The steps at which a planner asks."""
    planner = make_planner(kind, server, **options)
    at = []
    plan = planner.plan

    def watched(observation, step):
        server.answer = lambda body: at.append(step) or answer
        return plan(observation, step)

    planner.plan = watched
    play_in_chunks(planner, steps, chunk)
    return at


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
    ("kind", "answer", "options", "steps"),
    [
        ("qwen", REPLY, {}, range(0, 321, 16)),
        ("qwen", REPLY, {"asked": "every 40 steps"}, [0, 48, 80, 128, 160, 208, 240, 288, 320]),
        ("qwen", REPLY, {"asked": "every 7 steps"}, range(0, 321, 16)),  # two periods in a chunk
        ("qwen", "press the button at (3,4) to stop", {}, range(0, 321, 16)),
        # The last step of a hold belongs to it.
        ("qwen", "press the button at (3,4)", {"chunk": 10}, [0, *range(100, 321, 10)]),
        ("qwen", "press the first button", {"chunk": 10}, [0, *range(110, 321, 10)]),
        ("qwen", "press the second button", {"chunk": 10}, [0, *range(260, 321, 10)]),
        ("memer", REPLY_OF["memer"], {}, range(0, 321, 16)),
        ("gemini", REPLY_OF["gemini"], {}, [0, 96, 144, 192, 240, 288]),
        ("gemini", REPLY_OF["gemini"], {"first_pause": 0}, range(0, 321, 48)),
        ("gemini", REPLY_OF["gemini"], {"first_pause": 144}, [0, 144, 192, 240, 288]),
    ],
)
def test_each_planner_asks_its_model_at_the_steps_that_its_options_set(
    kind, answer, options, steps
):
    """`steps` are those at which it asks in 320 steps, which the policy plays in chunks of 16."""
    with fake_vlm(["x"]) as server:
        assert asked_at(server, kind, answer, 320, **options) == list(steps)


@pytest.mark.parametrize("kind", KINDS)
def test_after_an_unreadable_reply_the_last_subgoal_stays(kind):
    """A reply is unreadable after a second try; replies are {}, {}, a good one, then {} only."""
    with fake_vlm(["{}", "{}", REPLY_OF[kind], "{}"]) as server:
        planner = make_planner(kind, server, **({"first_pause": 0} if kind == "gemini" else {}))
        policy = play_in_chunks(planner, 64)  # five chunks of 16, from step 0
        assert policy.policy.told == [SUBGOAL] * 4  # none at first

        usage = planner.usage()
        assert (usage["unparsed"], usage["unreadable"]) == (2 if kind == "gemini" else 4, 1)
        assert usage["calls"] == len(server.requests) == 1 + 2 * usage["unparsed"]


def test_a_planner_that_waits_for_a_subgoal_s_end_repeats_an_unreadable_question():
    with fake_vlm([REPLY, "{}"]) as server:
        planner = make_planner("qwen", server, asked="when-done")
        planner.reset("Do it.", NO_VIDEO)
        assert planner.plan(observation_at(0), 0) == SUBGOAL

        planner.hear("Now.", 1)
        for step in range(CHUNK, 20 * CHUNK, CHUNK):
            planner.plan(observation_at(step), step)
        assert len(server.requests) == 1 + 2 * MOST_USELESS


def test_the_qwen_planner_sends_the_subgoals_so_far_and_the_current_picture():
    """Pictures have their step as their shade of grey."""
    answers = [REPLY, REPLY.replace("500", "700"), "put it down", REPLY]
    with fake_vlm(answers) as server:
        play_in_chunks(make_planner("qwen", server, video="mp4"), 48, demonstration=video(60))
        assert [pictures(body) for body in server.requests] == [[0], [16], [32], [48]]

    told = [body["messages"][1]["content"][3]["text"] for body in server.requests]

    assert "nothing has been done" in told[0]
    # The same words at another place are not another subgoal.
    assert told[1] == told[2] == f"Subgoals so far, in order: 1. {REPLY}"
    assert told[3] == f"Subgoals so far, in order: 1. {REPLY}; 2. put it down"


def test_the_gemini_planner_sends_a_video_clip_in_each_turn_of_a_conversation():
    with fake_vlm([REPLY_OF["gemini"]]) as server:
        options = {"sampling_fps": 5, "observe_every": 2}
        policy = play_in_chunks(make_planner("gemini", server, "google", **options), 144,
                       demonstration=video(20))  # fmt: skip
        first, second, third = server.requests
    assert server.paths[0].endswith("models/fake:generateContent")
    assert third["contents"][:3] == second["contents"]

    frames, rate = clip(first)
    assert (len(frames), rate) == (21, 15)  # the demonstration and the first frame
    assert policy.demonstration_frames == 2
    assert [part.get("videoMetadata") for part in first["contents"][0]["parts"]].count({"fps": 5})

    shades = clip(second)[0][:, 0, 0, 0].astype(int)
    assert np.abs(shades - np.arange(2, 97, 2)).max() < 4
    assert len(clip(third)[0]) == 24


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


@pytest.mark.parametrize("kind", KINDS)
def test_planners_send_nothing_of_the_last_episode_in_the_next_one(kind):
    """Its words, video, pictures and subgoals."""
    with fake_vlm([REPLY_OF[kind].replace("[]", "[1]")]) as server:
        planner = make_planner(kind, server, clip_frames=2)
        play_in_chunks(planner, 112, instruction="First.", demonstration=video(20))
        before = len(server.requests)
        again = {name: frames[7:] for name, frames in video(10).items()}
        play_in_chunks(planner, 0, instruction="Second.", demonstration=again)

        (body,) = server.requests[before:]

        assert pictures(body) == ([7, 0] if kind == "gemini" else [7, 9, 0])
        assert not re.search("First|red cube at", json.dumps(body))
        assert planner.usage()["calls"] == 1


class Refusing(PolicyThatStandsStill):
    """Refuses every subgoal."""

    endings = property(
        lambda self: [
            SubgoalEnd(thing, "refused", "no", "cube", n) for n, thing in enumerate(self.told)
        ]
    )

    def settle(self):
        pass


@pytest.mark.parametrize("when", ["when-done", "every 99 steps"])
def test_a_planner_whose_subgoals_are_refused_asks_five_times_in_an_episode(when):
    """The planner learns that a subgoal was refused, not what it meant in the world."""
    with fake_vlm([REPLY]) as server:
        planner = make_planner("stateless", server, asked=when)
        policy = HierarchicalPolicy(planner, Refusing())
        for asked in (5, 10):
            policy.reset("Do it.", NO_VIDEO)
            assert (policy.subgoal, policy.endings) == (None, [])
            for step in (0, CHUNK):
                policy.act({**observation_at(step), "history": ()})
            assert len(server.requests) == asked
            assert planner.ends == [SubgoalEnd(SUBGOAL, "refused", "no")]


@pytest.mark.parametrize(
    ("ends", "stages"),
    [
        ("done missed done blocked done time-out done missed", [1, 1, 2, 1, 2, 1, 2, 3]),
        ("refused", [3]),
    ],
)
def test_a_failed_stage_is_repeated_from_its_pick_and_at_most_three_times(ends, stages):
    """Stages are 0 hover, 1 pick and 2 drop; `stages` are those due after each end."""
    planner = make_policy("planner:listener", 3).planner
    assert planner._decider.seed == 3  # by which it guesses

    planner._index = planner._retries = 0
    planner._decider.stages = [
        SimpleNamespace(primitive=Primitive(kind, "cube"))
        for kind in ("hover", "pick_cube", "drop_into")
    ]
    found = []
    for how in ends.split():
        planner.learn(SubgoalEnd("", how))
        found.append(planner._index)

    assert found == stages


@pytest.mark.parametrize("last", ["all tasks completed", "the task is complete", "it is done"])
def test_all_is_done_from_the_gemini_model_leaves_the_last_subgoal(last):
    done = json.dumps({"description": "x", "subgoal": last})
    with fake_vlm([REPLY_OF["gemini"], done]) as server:
        assert set(play_in_chunks(make_planner("gemini", server), 144).policy.told) == {SUBGOAL}


def test_the_memer_planner_sends_recent_frames_and_the_key_frames_it_chose():
    """In an episode after another one, of which nothing is shown."""

    def choose(*positions):
        return json.dumps({"current_subtask": REPLY, "keyframe_positions": positions})

    before = [choose(1), choose(2)]
    answers = [choose(1), choose(8, 2), choose(1), choose(), choose(8)]
    with fake_vlm([*before, *answers]) as server:
        planner = make_planner("memer", server)
        play_in_chunks(planner, 16)
        policy = play_in_chunks(planner, 64).policy
        shown = [pictures(body) for body in server.requests[len(before) :]]

    # 0; 0, 4, 16 make 4 and 16, where 16 and 18 make 18; then 64 besides.
    assert shown == [
        [0],
        [0, *range(2, 17, 2)],
        [4, 16, *range(18, 33, 2)],
        [4, 18, *range(34, 49, 2)],
        [4, 18, *range(50, 65, 2)],
    ]
    assert list(planner.frames) == [4, 18, 64]
    # The policy sees the moments of its own period.
    seen = [
        observation["front_rgb"][0, 0, 0] for view in policy.seen for observation in view["history"]
    ]
    assert seen == list(range(3, 65, 3))


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
    """In each reply the model chooses the first of the frames that it sees."""
    choose = json.dumps({"current_subtask": REPLY, "keyframe_positions": [1]})
    with fake_vlm([choose]) as server:
        planner = make_planner("memer", server, **option)
        play_in_chunks(planner, 96)
        assert list(planner.frames) == kept


@pytest.mark.parametrize("subgoals", ["simple", "grounded"])
@pytest.mark.parametrize("kind", KINDS)
def test_requests_of_planners_are_equal_to_the_stored_ones(kind, subgoals):
    provider = "google" if kind == "gemini" else "openai"
    with fake_vlm([REPLY_OF[kind]]) as server:
        planner = make_planner(
            kind, server, provider, subgoals=subgoals, video="mp4", max_output_tokens=128
        )
        play_in_chunks(planner, 96 if kind == "gemini" else 16, demonstration=video(60, 256),
              instruction="Put the red one into the bin.", size=256)  # fmt: skip
        name = f"planner-{kind}-{subgoals}"
        check_capture(name, [golden(server.requests[0]), golden(server.requests[-1])])


def test_the_page_of_planners_shows_a_stored_request_and_a_reply():
    """It is the second request, which names the first subgoal."""
    _, request = json.loads((CAPTURES / "planner-qwen-grounded.json").read_text())
    check_sample("planners.md", request, REPLY)


def test_planner_and_policy_form_a_policy_whose_costs_are_summed():
    """Three questions to the planner's model, and one call at 0.5 US dollars by the policy."""
    with fake_vlm([REPLY]) as server:
        policy = play_in_chunks(make_planner("qwen", server, input_price=1.0), 32)
        assert isinstance(policy, Policy)
        assert not isinstance(policy, PrivilegedPolicy)
        assert spent(policy) == {
            "calls": 4,
            "input_tokens": 3 * TOKENS[0],
            "output_tokens": 3 * TOKENS[1],
            "unparsed": 0,
            "cost_usd": pytest.approx(0.5 + 3 * TOKENS[0] / 1e6),
        }
        assert policy.metadata["policy"] == {"checkpoint": "seven"}
        assert policy.metadata["planner"]["model"]["model"] == "fake"

        policy.close()


def test_the_oracle_planner_refuses_an_environment_without_pixel_positions():
    policy = HierarchicalPolicy(OraclePlanner(), PolicyThatStandsStill())
    assert isinstance(policy, PrivilegedPolicy)
    with pytest.raises(InvalidValueError, match="grounded=True"):
        policy.attach(roboirg.make("PickXtimes", cameras=()))


@pytest.mark.parametrize("kind", ["qwen", "gemini", "memer"])
def test_a_planner_quotes_also_the_sentence_that_was_said_during_the_episode(kind):
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
    assert "This one is red. Take it." in last
    if kind == "gemini":  # its conversation says the same thing once
        assert last.count("Take it.") == 1


class Silent:
    """The scripted hands without their reports."""

    cameras = ()
    demonstration_frames = "none"

    def __init__(self):
        self._hands = ScriptedHands()
        self.attach, self.reset = self._hands.attach, self._hands.reset
        self.follow, self.act = self._hands.follow, self._hands.act


@pytest.mark.sim
def test_a_planner_moves_on_with_hands_that_do_not_report_the_end_of_a_subgoal():
    policy = HierarchicalPolicy(make_by_kind("listener", {}, "test"), Silent())
    assert not policy.reports

    env = roboirg.make("StopCube", setting="explicit", cameras=(), demonstration_frames="none")
    assert play(env, policy)["status"] == "success"
