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


def stages_of(task):
    """Yield (stage, scene) for all goals of the scenes of eight test episodes."""
    for index in range(8):
        scene = get_episode(task, "test", index).scene
        for goal in get_task(task).goals(scene):
            for stage in get_task(task).stages(scene, goal):
                yield stage, scene


@pytest.mark.parametrize("task", TASKS)
def test_the_text_of_every_subgoal_is_read_as_the_motion_it_stands_for(task):
    """The motion of a stage has a kind, such as *pick_cube*, and `read_subgoal` returns it too.

    Two kinds have words of another one (AS_READ): *press from above* is read as a press, and *hold
    until …* as a hold. Stages are those of all goals of the scenes of eight test episodes.
    """
    for stage, _ in stages_of(task):
        kind = stage.primitive.kind
        assert read_subgoal(plain_subgoal(stage)).kind == AS_READ.get(kind, kind), stage.subgoal


@pytest.mark.parametrize("task", TASKS)
def test_the_point_of_a_subgoal_and_the_kind_of_thing_at_it_are_read(task):
    """A subgoal has `{at}` where a point belongs, here <12, 200>: a row and a column of a picture.

    A stage points at a thing of its scene, such as cube_red: what is read is its kind, *cube*.
    """
    stages_with_a_point = [(stage, scene) for stage, scene in stages_of(task) if stage.points_at]

    assert stages_with_a_point
    for stage, scene in stages_with_a_point:
        request = read_subgoal(stage.subgoal.replace("{at}", "at <12, 200>"))
        assert (request.point, request.thing) == ((12, 200), scene[stage.points_at].kind)


@pytest.mark.parametrize(
    ("words", "steps"), [("remain static", 16), ("Remain static for 40 steps.", 40)]
)
def test_remain_static_is_read_with_its_number_of_steps(words, steps):
    """Without a number it means 16 steps, the length of a chunk."""
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
    """The hands hold nothing, and no cube is purple or seen in the upper left corner, at <0, 0>.

    VideoRepick has several cubes, and *correct* tells none apart. The simulation has done as many
    steps after the subgoal as before; the hands count one refusal.
    """
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
    """The fixture has the name of a cube that is not red, and the point where it is seen.

    *Pick up the red cube at* this point: the hands pick up the cube at the point.
    """
    env, hands, name, point = cube_that_is_not_red

    end = follow_to_the_end(env, hands, f"pick up the red cube at {point}")

    assert (end.how, end.thing) == ("done", name)


@pytest.mark.sim
def test_what_the_hands_hold_is_meant_by_it(cube_that_is_not_red):
    """The hands pick up a cube by the point at which it is seen; then *it* is this cube."""
    env, hands, name, point = cube_that_is_not_red
    follow_to_the_end(env, hands, f"pick up the cube at {point}")

    end = follow_to_the_end(env, hands, "put it down")

    assert (end.how, end.thing) == ("done", name)


@pytest.mark.sim
def test_a_subgoal_that_was_just_done_is_done_without_moving(cube_that_is_not_red):
    """The cube is in the hand, so to pick it up once more is done at once, in no step."""
    env, hands, _, point = cube_that_is_not_red
    follow_to_the_end(env, hands, f"pick up the cube at {point}")
    steps = env.session.world.elapsed

    hands.follow(f"pick up the cube at {point}")

    assert [end.how for end in hands.endings] == ["done", "done"]
    assert env.session.world.elapsed == steps


@pytest.mark.sim
@pytest.mark.parametrize("task", slow_but(["StopCube", "ButtonUnmaskSwap"], TASKS))
def test_the_oracle_with_scripted_hands_succeeds(task):
    """The planner "oracle" names the right subgoals, and the hands read the simulator.

    A grip may miss, and then is repeated; nothing may be refused or blocked.
    """
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
    """The planner "listener" understands the words of the setting *reasoning* by their meaning."""
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
    """The planner's model always gives this reply: a subgoal that the hands refuse, as nothing is
    in the hand; words that are no subgoal; or a reply that comes after 10 s, where 1 s is the
    limit.
    """
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


def play_stateless(replies):
    """Play 60 steps of VideoUnmask by a planner whose model gives these replies in turn.

    Returns the policy, and the words of each request that the model got.
    """
    with fake_vlm(replies) as server:
        policy = make_policy(f"planner:stateless?base_url={server.url}/v1&model=x", 0)
        env = roboirg.make("VideoUnmask", max_steps=60, **PolicyNeeds.of(policy).env_options)
        play(env, policy)
    return policy, [words_of(request) for request in server.requests]


@pytest.mark.sim
def test_the_stateless_planner_asks_with_a_list_of_ended_subgoals():
    """The planner asks its model whenever a subgoal has ended, and lists how the earlier ones did.

    The model names *sing*, which the hands refuse at once (step 0); *remain static*, which means 16
    steps; the same for 5 steps, till step 21; and then says *done*.
    """
    replies = ["sing", "remain static", "Remain static for 5 steps.", "done"]

    _, (first, second, third, fourth) = play_stateless(replies)

    assert "nothing has been done" in first
    assert "1. sing: refused, these words are no subgoal that the hands know (step 0)" in second
    assert "2. remain static: done (step 16)" in third
    assert "3. remain static for 5 steps: done (step 21)" in fourth


@pytest.mark.sim
def test_a_stateless_planner_whose_model_says_done_asks_no_more():
    """The first reply is not readable, so the question is asked again; the second names a subgoal
    below a thought; the third says *done*. The episode goes on for 60 steps all the same.
    """
    thought = "First.\n\nRemain static for 5 steps.\n"

    policy, requests = play_stateless(["?<", thought, "done"])

    assert len(requests) == 3
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
    """RoboMME lets a model choose among the motions of a task: `choices`, in its order, with a plus
    behind a motion for which a point has to be chosen.

    They are the same in all episodes of a task, of which 20 are tried. Their labels are letters.
    """
    for episode in range(20):
        labels = ""
        motions = []
        for choice in choices_of(get_episode(task, "test", episode)):
            motion = choice.primitives[0].kind
            motions.append(motion if choice.kind is None else f"{motion}+")
            labels += choice.label

        assert " ".join(motions) == choices
        assert "abcd".startswith(labels)


@pytest.mark.sim
def test_an_episode_can_be_solved_with_the_action_space_choice():
    """The choices of PickXtimes are a, pick; b, place; and c, press.

    An action is a letter and a pixel: that of the cube to pick, or none. At each step the letter
    of the motion that the task's judge expects next is chosen, and so the episode succeeds.
    """
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
    """An action is (choice, row, column), with choices 0 to 2.

    Refused are choice 3, choice 0 (pick) without its pixel, and half a choice.
    """
    env = roboirg.make("PickXtimes", episode=2, actions="choice", cameras=())
    env.reset()

    with pytest.raises(InvalidActionError, match="Choice"):
        env.step(action)

    assert env.executed_actions == 0
