"""The scripted hands: what they read, what they refuse, and what planners reach with them."""

import re
from pathlib import Path

import pytest
from planning_fakes import Late, fake_vlm, words_of
from selection import slow_but

import roboirg
from roboirg.analysis.measures.planner_failures import planner_failure
from roboirg.core.actions import choice_action
from roboirg.core.errors import InvalidActionError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.core.policy_needs import PolicyNeeds
from roboirg.core.subgoal_words import read_subgoal
from roboirg.judging import plain_subgoal
from roboirg.policies import make_policy, play
from roboirg.policies.by_name.finding import read_policy
from roboirg.policies.hands.scripted_hands import ScriptedHands
from roboirg.policies.planners import make_planner
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.records.record import Job
from roboirg.runs.play.rollout import EpisodeRunner
from roboirg.tasks import all_tasks, get_task
from roboirg.tasks.choices import choices_of
from roboirg.tasks.splits.splits import get_episode

TASKS = [name for name in all_tasks() if get_task(name).suite != "real"]
SOME_TASKS = ("BinFill", "StopCube", "VideoUnmask", "VideoRepick", "VideoPlaceOrder")
AS_READ = {"press_below": "press", "hold_until": "hold"}


def environment_and_hands(task, episode=0, **options):
    """An environment and hands in it, at the beginning of their turn."""
    env = roboirg.make(task, episode=episode, cameras=(), **options)
    env.reset()
    hands = ScriptedHands()
    hands.attach(env)
    hands.reset("", {})
    return env, hands


def follow_to_the_end(env, hands, subgoal):
    """Let hands follow a subgoal to its end; return how it ended."""
    hands.follow(subgoal)
    while not hands.endings or hands.endings[-1].subgoal != subgoal:
        env.step_chunk(hands.act({}))
        hands.settle()
    return hands.endings[-1]


def play_with(planner, task, episode=0, setting="explicit"):
    """Play an episode with a planner of ours in front of the hands.

    Returns how it ended, and the policy.
    """
    policy = HierarchicalPolicy(make_planner(planner, {}, "the test"), ScriptedHands())
    needs = PolicyNeeds.of(policy).env_options
    env = roboirg.make(task, episode=episode, setting=setting, **needs)
    return play(env, policy), policy


@pytest.mark.parametrize("task", TASKS)
def test_the_text_of_every_subgoal_is_read_as_the_motion_it_stands_for(task):
    """With a point, at <12, 200>, and without."""
    for index in range(8):
        episode = get_episode(task, "test", index)
        for goal in get_task(task).goals(episode.scene):
            for stage in get_task(task).stages(episode.scene, goal):
                kind = stage.primitive.kind
                grounded = stage.subgoal.replace("{at}", "at <12, 200>")
                for words in (plain_subgoal(stage), grounded):
                    request = read_subgoal(words)
                    assert request is not None, words
                    assert request.kind == AS_READ.get(kind, kind)
                    assert request.point == ((12, 200) if "<" in words else None)
                if stage.points_at:
                    assert request.thing == episode.scene[stage.points_at].kind


@pytest.mark.parametrize(
    ("words", "steps"), [("remain static", 16), ("Remain static for 40 steps.", 40)]
)
def test_remain_static_is_read_with_its_number_of_steps(words, steps):
    assert read_subgoal(words).steps == steps


@pytest.mark.parametrize("words", ["", "la la la", "pick up the red banana", "press", "pick"])
def test_nonsense_and_incomplete_words_are_not_read_as_a_subgoal(words):
    assert read_subgoal(words) is None


@pytest.mark.sim
@pytest.mark.parametrize(
    ("task", "subgoal", "why"),
    [
        ("BinFill", "put it into the bin", "nothing is in the hand"),
        ("BinFill", "pick up the purple cube", "nothing fits the words 'purple cube'"),
        ("BinFill", "pick up the cube at <0, 0>", "no cube is within 24 pixels of <0, 0>"),
        ("BinFill", "sing", "these words are no subgoal"),
        ("VideoRepick", "pick up the correct cube", r"\d things fit the words 'cube'"),
    ],
)
def test_a_subgoal_that_fits_no_object_or_several_is_refused_without_moving(task, subgoal, why):
    env, hands = environment_and_hands(task)
    before = env.session.world.elapsed

    hands.follow(subgoal)

    assert hands.endings[-1].how == "refused"
    assert re.search(why, hands.endings[-1].why)
    assert env.session.world.elapsed == before
    assert hands.usage() == {"refused": 1, "missed": 0}


@pytest.fixture
def cube_that_is_not_red():
    """PickXtimes with hands, a cube of another color, and the point at which it is seen."""
    from roboirg.simulation.expert.things import origin_pixel

    env, hands = environment_and_hands("PickXtimes", 2)
    for body in env.session.world.bodies.values():
        if body.item.kind == "cube" and body.item.color != "red":
            row, column = origin_pixel(body)
            return env, hands, body.item.name, f"<{row}, {column}>"
    raise LookupError("all cubes are red")


@pytest.mark.sim
def test_a_subgoal_with_a_point_means_the_object_at_the_point_despite_its_words(
    cube_that_is_not_red,
):
    env, hands, name, point = cube_that_is_not_red

    end = follow_to_the_end(env, hands, f"pick up the red cube at {point}")

    assert (end.how, end.thing) == ("done", name)


@pytest.mark.sim
def test_what_the_hands_hold_is_meant_by_it(cube_that_is_not_red):
    env, hands, name, point = cube_that_is_not_red
    follow_to_the_end(env, hands, f"pick up the cube at {point}")

    end = follow_to_the_end(env, hands, "put it down")

    assert (end.how, end.thing) == ("done", name)


@pytest.mark.sim
def test_a_subgoal_that_was_just_done_is_done_without_moving(cube_that_is_not_red):
    env, hands, _, point = cube_that_is_not_red
    follow_to_the_end(env, hands, f"pick up the cube at {point}")
    steps = env.session.world.elapsed

    hands.follow(f"pick up the cube at {point}")

    assert [end.how for end in hands.endings] == ["done", "done"]
    assert env.session.world.elapsed == steps


@pytest.mark.sim
@pytest.mark.parametrize("task", slow_but(["StopCube", "ButtonUnmaskSwap"], TASKS))
def test_the_oracle_with_scripted_hands_succeeds(task):
    info, policy = play_with("oracle", task, episode=3)

    assert info["status"] == "success", (info["cause"], policy.endings)
    assert {ending.how for ending in policy.endings} <= {"done", "missed"}


@pytest.mark.sim
def test_the_oracle_planner_succeeds_though_the_arm_hides_the_object_it_points_at():
    """What is put down stands between camera and thing: in 4 of 550 episodes of the test split."""
    info, policy = play_with("oracle", "VideoUnmaskSwap", episode=23)

    assert info["status"] == "success", (info["cause"], policy.endings)


@pytest.mark.sim
@pytest.mark.parametrize("task", slow_but(["StopCube", "VideoUnmask"], SOME_TASKS))
def test_the_listener_planner_succeeds_from_the_words_alone(task):
    info, _ = play_with("listener", task, episode=1, setting="reasoning")

    assert info["status"] == "success"


@pytest.mark.sim
@pytest.mark.slow
@pytest.mark.parametrize(
    ("reply", "timeout_s", "named"),
    [
        ("put it into the bin", 60, "refused"),
        ("la la la", 60, "unreadable"),
        (Late(10.0), 1, "no answer"),
    ],
)
def test_a_failed_record_names_the_fault_of_its_planner(reply, timeout_s, named):
    with fake_vlm([reply]) as server:
        model = f"base_url={server.url}/v1&model=stub&timeout_s={timeout_s}&retries=0"
        spec = f"planner:stateless?{model}&observe_every=400"  # few pictures are drawn
        job = Job(policy=spec, ref=read_policy(spec), task="PickXtimes", split="test", episode=0,
                  options=InstructionOptions("explicit"))  # fmt: skip
        record, *_ = EpisodeRunner(Path()).play_once(job)
    assert planner_failure(record) == named


@pytest.mark.parametrize(
    "spec",
    [
        "planner:listener",
        "planner:stateless?base_url=http://localhost:1/v1&model=x",
        "system:GroundSG-QwenVL?hands=scripted&vlm=http://localhost:1/v1",
        "system:MemER?hands=scripted&vlm=http://localhost:1/v1&model=x",
        "system:GroundSG-Gemini?hands=scripted",
    ],
)
def test_planners_with_scripted_hands_can_be_named_on_the_command_line(spec):
    """Hands that read the simulator make the whole privileged, next to the world."""
    ref = read_policy(spec)
    policy = make_policy(spec, 0)

    assert ref.is_privileged
    assert not ref.is_hosted
    assert "scripted hands" in policy.version
    assert policy.metadata["policy"] == {"hands": "scripted"}


@pytest.mark.sim
def test_the_stateless_planner_asks_with_a_list_of_ended_subgoals():
    """The third reply has thoughts before the subgoal, the fourth is unreadable and asked again."""
    replies = ["sing", "remain static", "First.\n\nRemain static for 5 steps.\n", "?<", "done"]
    with fake_vlm(replies) as server:
        policy = make_policy(f"planner:stateless?base_url={server.url}/v1&model=x", 0)
        env = roboirg.make("VideoUnmask", max_steps=60, **PolicyNeeds.of(policy).env_options)
        play(env, policy)

    first, second, third, fourth, _again = map(words_of, server.requests)
    assert "nothing has been done" in first
    assert "1. sing: refused, these words are no subgoal that the hands know (step 0)" in second
    assert "2. remain static: done (step 16)" in third
    assert "3. remain static for 5 steps: done (step 21)" in fourth
    assert policy.usage()["finished"] == 1


@pytest.mark.parametrize(
    ("task", "choices"),
    [
        ("BinFill", "pick_cube+ drop_into press"),
        ("PickXtimes", "pick_cube+ place_on press"),
        ("SwingXtimes", "pick_cube+ move_over+ put_down press"),
        ("StopCube", "hover hold_until press_below"),
        ("VideoUnmask", "pick_container+ put_down"),
        ("VideoUnmaskSwap", "pick_container+ put_down"),
        ("ButtonUnmask", "press pick_container+ put_down"),
        ("ButtonUnmaskSwap", "press press pick_container+ put_down"),
        ("VideoRepick", "pick_cube+ put_down press"),
        ("VideoPlaceButton", "pick_cube+ place_on+ press"),
        ("VideoPlaceOrder", "pick_cube+ place_on+ press"),
    ],
)
def test_the_choices_of_each_task_are_those_of_robomme(task, choices):
    """A plus marks a motion for which a point has to be chosen."""
    for index in range(20):
        found = choices_of(get_episode(task, "test", index))
        motions = []
        for choice in found:
            motion = choice.primitives[0].kind
            motions.append(motion if choice.kind is None else f"{motion}+")
        if task != "StopCube" or len(found) == 3:  # some episodes leave no time to wait
            assert " ".join(motions) == choices
        assert [choice.label for choice in found] == list("abcd"[: len(found)])


@pytest.mark.sim
def test_an_episode_can_be_solved_with_the_action_space_choice():
    """An action is a letter of the choice and a pixel: of the cube to pick, else none."""
    from roboirg.simulation.expert.things import origin_pixel

    env = roboirg.make("PickXtimes", episode=2, actions="choice", cameras=())
    _, info = env.reset()
    assert [choice["label"] for choice in info["available_multi_choices"]] == ["a", "b", "c"]

    while info["status"] == "ongoing":
        motion = env.session.judge.published.primitive
        if motion.kind == "pick_cube":
            action = choice_action("a", origin_pixel(env.session.world.bodies[motion.subject]))
        else:
            action = choice_action({"place_on": "b", "press": "c"}[motion.kind], None)
        *_, info = env.step(action)

    assert info["status"] == "success"


@pytest.mark.sim
@pytest.mark.parametrize("action", [[3, 0, 0], [0, -1, -1], [0.5, 1, 1]])
def test_an_action_that_is_no_choice_is_refused_without_moving(action):
    """There are three choices, 0 to 2; the first one needs a pixel."""
    env = roboirg.make("PickXtimes", episode=2, actions="choice", cameras=())
    env.reset()

    with pytest.raises(InvalidActionError, match="Choice"):
        env.step(action)

    assert env.executed_actions == 0
