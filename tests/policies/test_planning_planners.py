"""Planners in front of a policy: when they ask, what they show, and what comes of the answers."""

import base64
import json
from types import SimpleNamespace

import numpy as np
import pytest
from planning_fakes import (
    check_capture,
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


def memer_reply(*positions):
    """Return a reply that names a subgoal, and the frames to keep by their position."""
    return json.dumps({"current_subtask": REPLY, "keyframe_positions": positions})


def test_the_policy_behind_a_memer_planner_sees_the_moments_of_its_own_period():
    """The planner sees every second step, and the policy behind it wants every third.

    A picture has its step as its shade of grey. In an episode of 32 steps the policy sees 3, 6 …
    30: its own period, and nothing of the planner's.
    """
    with fake_vlm([memer_reply()]) as server:
        policy = play_in_chunks(make_planner("memer", server), 32).policy

    shades = []
    for observation in policy.seen:
        shades += [int(past["front_rgb"][0, 0, 0]) for past in observation["history"]]
    assert shades == [3, 6, 9, 12, 15, 18, 21, 24, 27, 30]


def observation_at(step, size=64):
    """What is seen at a step, its number as a shade of grey; nothing since the last question."""
    return {"front_rgb": np.full((size, size, 3), step % 256, np.uint8), "history": ()}


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
            policy.act(observation_at(step))
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
    """A policy acts in chunks of 80 steps, and its planner can ask only when a chunk begins.

    So in the steps from 0 to 320 a planner asks at 0, 80, 160, 240 and 320, whether it wants to
    ask at each chunk or, more often, every 7 steps.
    """
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
    """The model always names the same subgoal, and chunks have ten steps, in an episode of 320
    steps.

    A planner asks at step 0, then at each chunk from `asked_again` on: a button's subgoal is held
    until the step of the comment, and other words are not held, so that it asks ten steps later.
    """
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
    """Chunks have 16 steps, and `steps` are those of 0 to 320 at which the planner asks.

    After its first question it pauses for 75 steps unless the option says otherwise. 96 is the
    first multiple of 48 after 75; from there on it asks at each multiple of 48.
    """
    assert steps_asked("gemini", REPLY_OF["gemini"], **options) == steps


@pytest.mark.parametrize("kind", KINDS)
def test_after_an_unreadable_reply_the_last_subgoal_stays(kind):
    """A planner asks its model at steps 0 and 96, where chunks begin. `{}` is unreadable, so it
    asks twice at step 96, and then the subgoal of step 0 is told again.
    """
    with fake_vlm([REPLY_OF[kind], "{}", "{}"]) as server:
        policy = play_in_chunks(make_planner(kind, server), 96, chunk=96)

    assert policy.policy.told == [SUBGOAL, SUBGOAL]


@pytest.mark.parametrize("kind", KINDS)
def test_a_question_without_a_readable_reply_at_the_second_try_is_counted(kind):
    """A planner asks its model at steps 0, 96 and 192, each time twice if `{}` comes, which is not
    readable.

    Two questions have no answer (`unparsed`); the last reply is of no use (`unreadable`).
    """
    no_answer = ["{}", "{}"]
    with fake_vlm([*no_answer, REPLY_OF[kind], *no_answer]) as server:
        planner = make_planner(kind, server)
        play_in_chunks(planner, 192, chunk=96)

    usage = planner.usage()
    assert usage["calls"] == 5
    assert usage["unparsed"] == 2
    assert usage["unreadable"] == 1


def test_a_planner_that_waits_for_a_subgoal_s_end_repeats_an_unreadable_question_five_times():
    """The first reply names a subgoal, and all later ones, `{}`, are unreadable.

    What is said at step 1 makes the planner ask anew. It does so at the next five chunks, each time
    twice as the reply is unreadable, and then gives up: 1 + 5 · 2 = 11 requests in 20 chunks.
    """
    with fake_vlm([REPLY, "{}"]) as server:
        planner = make_planner("qwen", server, asked="when-done")
        planner.reset("Do it.", NO_VIDEO)

        planner.plan(observation_at(0), 0)
        planner.hear("Now.", 1)
        for chunk in range(1, 20):
            planner.plan(observation_at(16 * chunk), 16 * chunk)

    assert len(server.requests) == 11


def test_the_qwen_planner_sends_the_subgoals_so_far():
    """At four questions the model names: here, there, put down, here.

    *There* has the same words as *here* at another point, so it is not listed as another subgoal.
    """
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
    """The fixture holds the requests at steps 0, 96 and 144.

    The third starts with all three turns of the second (question, reply, question).
    """
    _, second, third = three_turns

    assert third["contents"][:3] == second["contents"]


def test_the_first_clip_of_the_gemini_planner_is_the_demonstration_and_the_first_frame(three_turns):
    """The demonstration has 20 frames, of a video at 15 a second."""
    frames, rate = clip(three_turns[0])

    assert (len(frames), rate) == (21, 15)


def test_the_gemini_planner_asks_google_to_sample_its_clip_at_the_given_rate(three_turns):
    """The planner of the fixture was made with the option `sampling_fps=5`.

    So a part of its first message asks Google for five frames a second.
    """
    parts = three_turns[0]["contents"][0]["parts"]

    assert {"fps": 5} in [part.get("videoMetadata") for part in parts]


def test_later_clips_of_the_gemini_planner_have_every_second_frame_since_the_turn_before(
    three_turns,
):
    """The fixture holds the requests at steps 0, 96 and 144 of a planner that sees every second
    step.

    So the second clip has steps 2, 4 … 96, and the third the 24 steps 98, 100 … 144. A picture has
    its step as its shade of grey, which the compression of a clip keeps to within 3.
    """
    _, second, third = three_turns
    shades = clip(second)[0][:, 0, 0, 0].astype(int)

    assert shades == pytest.approx(np.arange(2, 97, 2), abs=3)
    assert len(clip(third)[0]) == 24  # steps 98, 100, … 144


def test_the_gemini_planner_asks_for_the_demonstration_at_its_own_period():
    """Its policy wants no demonstration, and the planner every second frame: so they get these."""
    with fake_vlm([]) as server:
        planner = make_planner("gemini", server, observe_every=2)

    assert HierarchicalPolicy(planner, PolicyThatStandsStill()).demonstration_frames == 2


def test_the_gemini_planner_sends_pictures_to_a_service_that_takes_no_clips():
    """The service here is not Google's but another one, which takes single pictures only.

    The planner asks at steps 0, 3 and 6, and a picture has its step as its shade of grey. Each
    request has the whole conversation: the pictures of the questions so far, one of each.
    """
    with fake_vlm([REPLY_OF["gemini"]]) as server:
        options = {"asked": "every 3 steps", "first_pause": 0, "observe_every": 2}
        play_in_chunks(make_planner("gemini", server, **options), 6, chunk=3)
        assert [pictures(body) for body in server.requests] == [[0], [0, 3], [0, 3, 6]]


@pytest.fixture(scope="module")
def request_after_an_unreadable_answer():
    """Google's request at step 96 of an episode without a video: of the questions before, that at
    step 0 was answered, and both tries at step 48 were unreadable (*?*).
    """
    answer = REPLY_OF["gemini"]
    with fake_vlm([answer, "?", "?", answer]) as server:
        play_in_chunks(make_planner("gemini", server, "google", first_pause=0), 96)
    return server.requests[-1]


def test_the_gemini_planner_repeats_the_clip_after_an_unreadable_answer(
    request_after_an_unreadable_answer,
):
    """The clip of a question has the frames since the last answer; here that was at step 0, so it
    has the frames of all steps from 1 to 96.
    """
    frames, _rate = clip(request_after_an_unreadable_answer)

    assert len(frames) == 96


def test_the_gemini_planner_leaves_a_question_without_an_answer_out_of_the_conversation(
    request_after_an_unreadable_answer,
):
    """The question at step 0, its answer, and the question at step 96 remain."""
    turns = request_after_an_unreadable_answer["contents"]

    assert [turn["role"] for turn in turns] == ["user", "model", "user"]


@pytest.mark.parametrize(
    ("kind", "reply", "shades"),
    [
        ("qwen", REPLY_OF["qwen"], [7, 9, 0]),  # the video as two frames, and now
        ("gemini", REPLY_OF["gemini"], [7, 0]),  # video and now together as two frames
        ("memer", memer_reply(1), [7, 9, 0]),
    ],
)
def test_planners_send_nothing_of_the_last_episode_in_the_next_one(kind, reply, shades):
    """A planner plays two episodes; of the second one it sends one request.

    A picture's shade of grey is its step. The first episode has shades from 0 to 112, and MemER's
    planner was told to remember some. The second has a video of the shades 7, 8 and 9, of which two
    frames are sent (`clip_frames`), the first and the last, and the shade 0 now.
    """
    second_video = {name: frames[7:] for name, frames in video(10).items()}
    with fake_vlm([reply]) as server:
        planner = make_planner(kind, server, clip_frames=2)
        play_in_chunks(planner, 112, instruction="First.", demonstration=video(20))
        server.requests.clear()

        play_in_chunks(planner, 0, instruction="Second.", demonstration=second_video)

    (body,) = server.requests
    assert pictures(body) == shades
    assert "First" not in json.dumps(body)
    assert "red cube at" not in json.dumps(body)  # the subgoal of the first episode


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
    """The hands refuse every subgoal at once, so the planner asks anew, whatever its usual period
    is.

    After the fifth refusal it gives up: the second chunk brings no more questions. The next
    episode begins with five tries again, so that there are 10 requests in all.
    """
    with fake_vlm([REPLY]) as server:
        policy = HierarchicalPolicy(make_planner("stateless", server, asked=when), Refusing())

        counts = []
        for _ in range(2):
            policy.reset("Do it.", NO_VIDEO)
            policy.act(observation_at(0))
            policy.act(observation_at(CHUNK))
            counts.append(len(server.requests))

    assert counts == [5, 10]


def test_a_planner_learns_that_a_subgoal_was_refused_and_not_what_it_meant():
    """The hands report also which thing a subgoal meant, *cube*, and the step at which it ended.

    Both are left out of what the planner learns: only the simulator knows what was meant.
    """
    with fake_vlm([REPLY]) as server:
        planner = make_planner("stateless", server)
        policy = HierarchicalPolicy(planner, Refusing())
        policy.reset("Do it.", NO_VIDEO)

        policy.act(observation_at(0))

    assert planner.ends[-1] == SubgoalEnd(SUBGOAL, "refused", "no")


def stages_after(*ends):
    """Return which stage a planner names after each end of the last one; *over* for none.

    Its three stages are *hover*, *pick_cube* and *drop_into*, in this order. `ends` say how the
    subgoal of a stage ended: *done* or in another way.
    """
    kinds = ["hover", "pick_cube", "drop_into"]
    planner = make_policy("planner:listener", 3).planner
    planner._index = 0
    planner._retries = 0
    planner._decider.stages = [SimpleNamespace(primitive=Primitive(kind, "cube")) for kind in kinds]
    named = []
    for how in ends:
        planner.learn(SubgoalEnd("", how))
        named.append([*kinds, "over"][planner._index])
    return named


def test_a_planner_of_stages_goes_back_to_the_pick_if_a_cube_was_not_put_down():
    """A failed pick is repeated alone. After a failed drop the cube is no longer held."""
    named = stages_after("done", "missed", "done", "blocked")

    assert named == ["pick_cube", "pick_cube", "drop_into", "pick_cube"]


def test_a_planner_of_stages_gives_up_at_the_fourth_failure():
    """The first stage, *hover*, fails in three ways and is repeated each time."""
    named = stages_after("missed", "blocked", "time-out", "missed")

    assert named == ["hover", "hover", "hover", "over"]


def test_a_planner_of_stages_gives_up_if_a_stage_is_refused():
    assert stages_after("refused") == ["over"]


def test_a_planner_that_listens_guesses_by_the_seed_of_the_policy():
    """The policy is made with seed 3, and its planner's guesses at unclear words draw from that
    seed.
    """
    policy = make_policy("planner:listener", 3)

    assert policy.planner._decider.seed == 3


@pytest.mark.parametrize("last", ["all tasks completed", "the task is complete", "it is done"])
def test_all_is_done_from_the_gemini_model_leaves_the_last_subgoal(last):
    """The model names a subgoal at step 0, and at step 96 says in one of three ways that all is
    done.

    That is no subgoal, so the policy is told the subgoal of step 0 again.
    """
    done = json.dumps({"description": "x", "subgoal": last})
    with fake_vlm([REPLY_OF["gemini"], done]) as server:
        policy = play_in_chunks(make_planner("gemini", server), 96, chunk=96)

    assert policy.policy.told == [SUBGOAL, SUBGOAL]


def pictures_sent_by_memer(*replies):
    """Return the pictures of a request at each of the steps 0, 16, 32, ..., one for each reply of
    the model. A picture is the number of its step.
    """
    with fake_vlm(list(replies)) as server:
        play_in_chunks(make_planner("memer", server), 16 * (len(replies) - 1))
    return [pictures(body) for body in server.requests]


def test_the_memer_planner_sends_the_frames_that_its_model_chose_before_the_new_ones():
    """The model chooses frames by their position among the new ones: first the only one, of step 0,
    and then the 8th, of step 16.
    """
    sent = pictures_sent_by_memer(memer_reply(1), memer_reply(8), memer_reply())

    assert sent == [
        [0],
        [0, 2, 4, 6, 8, 10, 12, 14, 16],
        [0, 16, 18, 20, 22, 24, 26, 28, 30, 32],
    ]


def test_of_two_chosen_frames_near_each_other_the_memer_planner_keeps_the_later_one():
    """The model chooses step 0, and then the 2nd of the frames of steps 2, 4, ..., 16.

    Steps 0 and 4 are near each other: not more than 8 steps apart.
    """
    *_, last = pictures_sent_by_memer(memer_reply(1), memer_reply(2), memer_reply())

    assert last == [4, 18, 20, 22, 24, 26, 28, 30, 32]


@pytest.mark.parametrize("positions", [[0], [9], ["one"], [1.5], [True], "1", None])
def test_key_frame_positions_that_do_not_exist_make_a_memer_reply_unreadable(positions):
    """A position is a whole number, from 1 to the number of frames that were sent: at most 8 here.

    Questions come at steps 0 and 16, so that two of them stay without an answer, and no frame is
    kept.
    """
    with fake_vlm(
        [json.dumps({"current_subtask": REPLY, "keyframe_positions": positions})]
    ) as server:
        planner = make_planner("memer", server)
        play_in_chunks(planner, 16)

        assert planner.usage()["unparsed"] == 2
        assert planner.frames == {}


@pytest.mark.parametrize(
    ("option", "kept"), [({}, [2, 18, 34]), ({"most": 2}, [18, 34]), ({"near": 16}, [34])]
)
def test_options_of_the_memer_planner_limit_the_key_frames_it_keeps(option, kept):
    """At steps 0, 16, 32 and 48 the model is shown every second frame since the last question, and
    always chooses the first: those of steps 0, 2, 18 and 34.

    Of 0 and 2, which are near each other, the later one stays. With `most` = 2 the last two are
    kept. With `near` = 16 each is near the one before it, so that only 34 is left.
    """
    with fake_vlm([memer_reply(1)]) as server:
        planner = make_planner("memer", server, **option)
        play_in_chunks(planner, 48)

    assert list(planner.frames) == kept


@pytest.mark.parametrize("subgoals", ["simple", "grounded"])
@pytest.mark.parametrize(
    ("kind", "provider", "second_question"),
    [("qwen", "openai", 16), ("gemini", "google", 96), ("memer", "openai", 16)],
)
def test_requests_of_planners_are_equal_to_the_stored_ones(
    kind, provider, second_question, subgoals
):
    """The two requests of an episode, at step 0 and at the step of the second question (96 for
    Gemini's planner, as it pauses for 75 steps and then asks every 48).

    What is sent may change only on purpose. captures/planning has these requests, with a
    description in place of each picture; ROBOIRG_CAPTURE=1 writes them anew.
    """
    options = {"subgoals": subgoals, "video": "mp4", "max_output_tokens": 128}
    with fake_vlm([REPLY_OF[kind]]) as server:
        play_in_chunks(
            make_planner(kind, server, provider, **options), second_question,
            demonstration=video(60, 256), instruction="Put the red one into the bin.", size=256,
        )  # fmt: skip

    first, second = server.requests
    check_capture(f"planner-{kind}-{subgoals}", [golden(first), golden(second)])


def test_the_stateless_planner_labels_frames_of_the_video_and_of_the_past_with_their_steps(
    monkeypatch,
):
    """It sends frames on sheets, each labeled with its step; here the sheets are left out, and
    their labels kept.

    The question at step 0 shows the video, of 20 steps, as ten frames at even distances. The one at
    step 16 shows the video again, and every 16th frame of the past.
    """
    labels = []

    def sheets_with_labels(frames, words):
        labels.append(words)
        return frames[:1]

    monkeypatch.setattr(model_planners, "contact_sheets", sheets_with_labels)
    with fake_vlm(["remain static"]) as server:
        planner = make_planner("stateless", server, asked="each-chunk")
        play_in_chunks(planner, 16, demonstration=video(20))

    of_video, of_video_again, of_past = labels
    assert of_video == ["1", "3", "5", "7", "9", "12", "14", "16", "18", "20"]
    assert of_video_again == of_video
    assert of_past == ["16"]


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
    """The policy behind the planner declares the checkpoint *seven*, and the planner asks model
    *fake*.

    It is not privileged, as neither of the two reads the simulator.
    """
    with fake_vlm([REPLY]) as server:
        policy = HierarchicalPolicy(make_planner("qwen", server), PolicyThatStandsStill())

    assert isinstance(policy, Policy)
    assert not isinstance(policy, PrivilegedPolicy)
    assert policy.metadata["policy"] == {"checkpoint": "seven"}
    assert policy.metadata["planner"]["model"]["model"] == "fake"


def test_the_oracle_planner_refuses_an_environment_without_pixel_positions():
    """It names things by the pixel at which they are seen, and an environment has to publish
    these.

    That takes `grounded=True`, which the error names and the environment of this test lacks.
    """
    policy = HierarchicalPolicy(OraclePlanner(), PolicyThatStandsStill())
    assert isinstance(policy, PrivilegedPolicy)
    with pytest.raises(InvalidValueError, match="grounded=True"):
        policy.attach(roboirg.make("PickXtimes", cameras=()))


@pytest.mark.parametrize("kind", KINDS)
def test_a_planner_quotes_also_the_sentence_that_was_said_during_the_episode(kind):
    """*This one is red.* is said at the start, and *Take it.* after step 0. A planner asks at step
    0, and again at step 96.

    So the first request has only the first sentence, and the second both, in order, and once.
    """
    with fake_vlm([REPLY_OF[kind]]) as server:
        policy = HierarchicalPolicy(make_planner(kind, server), PolicyThatStandsStill(96))
        policy.reset("This one is red.", NO_VIDEO)
        policy.act(observation_at(0))
        policy.hear("Take it.", 0)
        policy.act(observation_at(96))

    first, second = map(json.dumps, server.requests)
    assert "This one is red." in first
    assert "Take it." not in first
    assert second.count("This one is red. Take it.") == 1


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
    """The hands here can do what is needed, but have no `endings`, by which others report.

    The planner then tells from what was done that a stage is over, and the episode succeeds.
    """
    policy = HierarchicalPolicy(make_by_kind("listener", {}, "test"), HandsThatDoNotReport())
    env = roboirg.make("StopCube", setting="explicit", cameras=(), demonstration_frames="none")

    info = play(env, policy)

    assert not policy.reports
    assert info["status"] == "success"
