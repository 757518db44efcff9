"""Every planted mistake is found by its name, and none in policies that are right."""

import re
from collections import deque
from typing import ClassVar

import expert_world
import numpy as np
import pytest
from expert_world import HONEST, REST, ROWS, Honest, OneByOne, pixels, record

from roboirg.apps.policy_check.check_result import FAIL, NOTE, PASS, WARN
from roboirg.apps.policy_check.policy_check import check_policy

PLANTED = []


def planted(check, words, verdict=WARN):
    """Declare the check that finds a mistake, words of its message, and the verdict."""

    def note(kind):
        PLANTED.append((kind, check, words, verdict))
        return kind

    return note


@planted("acts without a video", "got shape (16, 7)", FAIL)
class ForgetsGripper(Honest):
    def act(self, observation):
        return super().act(observation)[:, :7]


@planted("acts without a video", "must be a finite number", FAIL)
class DividesByZero(Honest):
    def act(self, observation):
        return super().act(observation) * np.nan


@planted("acts without a video", "got list", FAIL)
class GivesTexts(Honest):
    def act(self, observation):
        return [["open"] * 8]


@planted("acts without a video", "with pictures as floats from 0 to 1 with channels first", FAIL)
class WantsTensors(Honest):
    def act(self, observation):
        picture = observation["front_rgb"]
        assert picture.shape[0] == 3, "channels first"
        assert picture.dtype == np.float32, "floats"
        return np.tile(np.append(REST, 1.0), (ROWS, 1))


@planted("inputs unchanged", "changed joint_positions in place", FAIL)
class NormalizesInPlace(Honest):
    def act(self, observation):
        actions = super().act(observation)
        observation["joint_positions"] -= REST
        return actions


@planted("deterministic", "Two equal episodes differ", FAIL)
class ForgetsSeed(Honest):
    def act(self, observation):
        return super().act(observation) + np.random.default_rng().normal(0, 0.01, (ROWS, 8))


@planted("reset forgets", "differs by up to", FAIL)
class KeepsMemory(Honest):
    total = 0.0

    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.total += 1e-3
        self.memory += self.total * 1e5


@planted("reset forgets", "a queue of actions outlives the episode", FAIL)
class KeepsQueue(OneByOne):
    def __init__(self, seed=0):
        super().__init__(seed)
        self.kept = deque()

    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.queue = self.kept

    def act(self, observation):
        if not self.queue:
            self.queue.extend(Honest.act(self, observation)[:5])
        return self.queue.popleft()


@planted("turns", "keep what belongs to an episode in the object", FAIL)
class KeepsInClass(Honest):
    count: ClassVar[list[int]] = []

    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.count.clear()

    def act(self, observation):
        self.count.append(1)
        return super().act(observation) + 1e-3 * len(self.count)


@planted("order of words", "once 'Take ", FAIL)
class RemembersExplicitCommand(Honest):
    """Understands what is implicit by what was once said explicitly in the same scene."""

    commands: ClassVar[dict[float, str]] = {}

    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        if re.fullmatch(r"Take the \w+ cube and .*", instruction):
            self.commands[self.memory] = instruction
        self.instruction = self.commands.get(self.memory, instruction)


@planted("constant", "actions of two episodes are the same")
class ReadsPlaceholder(Honest):
    def act(self, observation):
        return np.tile(np.append(REST, 1.0), (ROWS, 1))


@planted("repetition", "repeats the first")
class NeverComputesAnew(Honest):
    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.chunk = None

    def act(self, observation):
        if self.chunk is None:
            self.chunk = super().act(observation)
        return self.chunk


@planted("late answers", "one moment earlier")
class ComputesAfterLooking(Honest):
    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.next = None

    def act(self, observation):
        chunk = super().act(observation)
        given, self.next = self.next, chunk
        return chunk if given is None else given


@planted("language", "3 instructions lead to the same actions")
class LosesPrompt(Honest):
    def reset(self, instruction, demonstration):
        super().reset("", demonstration)


@planted("prompt end", "The last of 21 words changes nothing")
class CutsPrompt(Honest):
    remembered_words = 20


@planted("prompt end", "The last of 36 words changes nothing")
class CutsPromptAndDeclaresMore(Honest):
    remembered_words = 35
    prompt_tokens = 200


@planted("pictures", "Other pictures of front and wrist lead to the same actions")
class Blind(Honest):
    def see(self, observation):
        return pixels(np.zeros((256, 256, 3)), np.zeros((256, 256, 3)))


@planted("pictures", "Other pictures of wrist lead to the same actions")
class SeesFrontTwice(Honest):
    def see(self, observation):
        return pixels(observation["front_rgb"], observation["front_rgb"])


@planted("state", "Joints, fingers and tool change nothing", NOTE)
class IgnoresState(Honest):
    def joints(self, observation):
        return REST

    def gripper(self, observation):
        return 1.0


@planted("video", "Another video leads to the same actions", NOTE)
class IgnoresVideo(Honest):
    def reset(self, instruction, demonstration):
        super().reset(instruction, {})


@planted("camera order", "the two cameras swapped")
class SwapsCameras(Honest):
    def see(self, observation):
        return pixels(observation["wrist_rgb"], observation["front_rgb"])


@planted("color order", "blue, green, red")
class ReadsBlueFirst(Honest):
    def see(self, observation):
        return pixels(observation["front_rgb"][..., ::-1], observation["wrist_rgb"][..., ::-1])


@planted("picture orientation", "turned by 180 degrees")
class TurnsPictures(Honest):
    def see(self, observation):
        names = "front_rgb", "wrist_rgb"
        return pixels(*(observation[name][::-1, ::-1] for name in names))


@planted("picture orientation", "upside down")
class FlipsPictures(Honest):
    def see(self, observation):
        return pixels(*(observation[name][::-1] for name in ("front_rgb", "wrist_rgb")))


@planted("picture range", "floats from 0 to 1")
class TakesBytesForFloats(Honest):
    def see(self, observation):
        names = "front_rgb", "wrist_rgb"
        return pixels(*(255 * np.asarray(observation[name], float) for name in names))


@planted("joint units", "if read as degrees", FAIL)
class AnswersInDegrees(Honest):
    def act(self, observation):
        actions = super().act(observation)
        actions[:, :7] = np.rad2deg(np.clip(actions[:, :7], REST - 0.4, REST + 0.4))
        actions[:, [0, 2, 4]] += 1e-6
        return actions


@planted("state units", "joint positions in degrees")
class ReadsDegrees(Honest):
    def joints(self, observation):
        return np.deg2rad(super().joints(observation))


@planted("joint targets", "changes of the joints that it was shown")
class AnswersChanges(Honest):
    def act(self, observation):
        actions = super().act(observation)
        actions[:, :7] -= self.joints(observation)
        return actions


@planted("joint targets", "changes from row to row")
class AnswersChangesOfRows(Honest):
    def act(self, observation):
        actions = super().act(observation)
        joints = np.vstack([self.joints(observation), actions[:, :7]])
        return np.column_stack([np.diff(joints, axis=0), actions[:, 7]])


@planted("jumps", "normalized targets were not scaled back")
class ForgetsToDenormalize(Honest):
    def act(self, observation):
        actions = super().act(observation)
        actions[:, :7] = (actions[:, :7] - REST) / 1.5
        return actions


@planted("gripper", "change the sign")
class InvertsGripper(Honest):
    def gripper(self, observation):
        return -super().gripper(observation)


@planted("gripper", "stretch the range")
class GripperFromZero(Honest):
    def gripper(self, observation):
        return (super().gripper(observation) + 1) / 2


@planted("gripper", "stretch the range")
class GripperInMeters(Honest):
    def gripper(self, observation):
        return 0.04 * (super().gripper(observation) > 0)


@planted("hears", "hear(): TypeError", FAIL)
class HearsTooLittle(Honest):
    def hear(self, text):
        self.instruction = text


def results_of(kind, **options):
    found = check_policy(f"{kind.__module__}:{kind.__name__}", record_expert=record, **options)
    assert all(one.message.endswith(".") for one in found)
    return found


def test_twenty_and_more_mistakes_are_planted():
    assert len({kind for kind, *_ in PLANTED}) >= 20


@pytest.mark.parametrize(
    ("kind", "check", "words", "verdict"), PLANTED, ids=[kind.__name__ for kind, *_ in PLANTED]
)
def test_a_planted_mistake_is_found_by_name(kind, check, words, verdict):
    results = results_of(kind)
    found = [one for one in results if one.check == check]
    assert [one.verdict for one in found] == [verdict]
    assert words in found[0].message
    # And taken for no other.
    assert {one.check for one in results if one.verdict in (FAIL, WARN)} <= {check}


@pytest.mark.parametrize("seed", [0, 1])
@pytest.mark.parametrize("kind", HONEST, ids=lambda kind: kind.__name__)
def test_nothing_is_found_in_honest_policies(kind, seed):
    assert {one.verdict for one in results_of(kind, seed=seed)} <= {PASS, NOTE}


def test_nothing_is_found_in_the_random_policy():
    assert {one.verdict for one in check_policy("random", record_expert=record)} <= {PASS, NOTE}


def test_the_expert_s_error_is_told():
    (told,) = [one for one in results_of(Honest) if one.check == "expert"]
    assert told.verdict == PASS
    assert told.message.startswith("At 20 moments")
    (told,) = [one for one in results_of(expert_world.Untrained) if one.check == "expert"]
    assert told.verdict == NOTE
