"""The conformance check finds what is wrong with a policy, and nothing where nothing is."""

import sys

import numpy as np
import pytest
import typer
from rich.console import Console
from typer.testing import CliRunner

from roboirg.apps.policy_check.check_result import CheckResult
from roboirg.apps.policy_check.commands import check_policy as command
from roboirg.apps.policy_check.policy_check import check_policy, print_check_results


class Sound:
    """Keeps the contract; what it does depends on everything that it is given."""

    observe_every = 1

    def __init__(self, seed=0):
        self.seed, self.metadata = seed, {"rate": np.float32(0.5)}

    def reset(self, instruction, demonstration):
        self.memory = float(len(instruction) + demonstration["front_rgb"].sum(dtype=float) % 97)
        demonstration["front_rgb"][:] = 0  # it may: the next episode has pictures of its own

    def act(self, observation):
        joints = observation["joint_positions"] + 0.0001 * (self.memory % 7)
        self.memory += len(observation["history"]) + observation["wrist_rgb"].mean() % 3
        rng = np.random.default_rng([self.seed, int(self.memory)])
        return np.tile(np.append(joints, rng.uniform(-1, 1)), (5, 1))


class Calibrated(Sound):
    depth = calibration = True


class Shapeless(Sound):
    def act(self, observation):
        return np.zeros((3, 7))


class NotFinite(Sound):
    def act(self, observation):
        return np.full((3, 8), np.nan)


class Raising(Sound):
    def act(self, observation):
        return observation["depth"]


class Elephant(Sound):
    """Never forgets."""

    count = 0

    def act(self, observation):
        self.count += 1
        return super().act(observation) * 0 + self.count**2 / 100


class Dice(Sound):
    def act(self, observation):
        return np.random.default_rng().uniform(-1, 1, (4, 8))


class HonestDice(Dice):
    deterministic = False
    version = "unknown"


class Growing(Sound):
    """Gives another number of actions each time."""

    total = 0

    def act(self, observation):
        type(self).total += 1
        return np.zeros((self.total, 8))


class Waypoints(Sound):
    actions = "waypoint"
    depth = True

    def act(self, observation):
        return super().act(observation)[:, :7]


class Unwritable(Sound):
    def reset(self, instruction, demonstration):
        super().reset(instruction, demonstration)
        self.metadata["rate"] = np.float32("nan")


class Priceless(Sound):
    def usage(self):
        return {"calls": None}


class Reckless(Sound):
    """One number of its second action is too large, two of the third, three of the last."""

    def act(self, observation):
        return np.eye(8)[5] - np.eye(8)[3] + 9.0 * np.tri(4, 8, -1)


def found(policy, verdict):
    return {f.check: f.message for f in check_policy(policy) if f.verdict == verdict}


def test_depth_and_matrices_are_named_if_a_policy_wants_them():
    requirements = found(f"{__name__}:Calibrated", "pass")["requirements"]
    assert requirements.endswith("observations every 1, depth, calibration.")


def test_what_is_not_compared_with_the_expert_is_named():
    told = check_policy(f"{__name__}:Waypoints", record_expert=print)[-1]
    assert told == (
        "expert",
        "note",
        "Not checked: the expert acts in joint_angle, not in waypoint.",
    )


def test_a_sound_policy_passes_everything():
    results = check_policy(f"{__name__}:Sound", seed=3)
    assert {result.verdict for result in results} == {"pass"}
    assert [result.check for result in results] == [
        "loads",
        "requirements",
        "version",
        "acts without a video",
        "acts with a video",
        "reports",
        "deterministic",
        "reset forgets",
    ]
    assert all(result.message.endswith(".") for result in results)
    assert "made with seed 3" in results[0].message
    assert "5, 5, 5 actions of 8 numbers, float64" in results[3].message
    assert found(Sound(), "fail") == {}


@pytest.mark.parametrize(
    ("kind", "check", "words"),
    [
        (Shapeless, "acts without a video", "expected shape (n, 8) with n >= 1, got shape (3, 7)"),
        (NotFinite, "acts without a video", "value 0 of row 0: expected a finite number, got nan"),
        (Raising, "acts without a video", "'depth'; the observation has end_effector, front_rgb,"),
        (Elephant, "reset forgets", "value 0 of row 0 in answer 1: expected 0.01, got 0.16"),
        (Dice, "deterministic", " in answer "),
        (Growing, "deterministic", "answer 1: expected 4 actions, got 7"),
        (Unwritable, "reports", "the policy's metadata: 'rate' is nan; it must be a text"),
        (Priceless, "reports", "usage() has None as 'calls'; it must be a number."),
    ],
)
def test_what_is_wrong_is_found(kind, check, words):
    failed = found(f"{__name__}:{kind.__name__}", "fail")
    assert words in failed[check]


def test_what_is_allowed_is_noted():
    notes = found(HonestDice(), "note")
    assert "as the policy declares" in notes["deterministic"]
    assert "set the attribute version" in notes["version"]
    assert found(f"{__name__}:HonestDice", "fail") == {}
    assert found(f"{__name__}:Reckless", "note")["range without a video"] == (
        "9 of 12 actions have a number outside the usual range of joint_angle; farthest is value 1 "
        "of action 2: expected -1.76 to 1.76, got 9. The robot executes them as well as it can."
    )
    assert "It is privileged" in found("oracle", "note")["loads"]


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("nothing", "There is no policy 'nothing'"),
        ("openpi://127.0.0.1:9?connect=0.1", "cannot be reached"),
        ("openpi://127.0.0.1:9?conect=0.1", "Did you mean 'connect'?"),
        (object(), "Expected reset() and act(), got no reset()."),
    ],
)
def test_what_cannot_be_tried_is_told(spec, words):
    assert any(words in sentence for sentence in found(spec, "fail").values())


@pytest.mark.parametrize(("name", "code"), [("Sound", 0), ("NotFinite", 2)])
def test_the_command_prints_a_table_and_an_exit_code(name, code, tmp_path, monkeypatch):
    (tmp_path / "my_policy.py").write_text(
        "import numpy as np\nclass Sound:\n    value = 0.0\n    def reset(self, i, d): pass\n"
        "    def act(self, o): return np.full((2, 8), self.value)\n"
        "class NotFinite(Sound):\n    value = np.nan\n"
    )
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setenv("COLUMNS", "200")
    app = typer.Typer()
    app.command()(command)

    result = CliRunner().invoke(app, [f"my_policy:{name}", "--no-expert"])

    assert result.exit_code == code, result.output
    assert ("9 checks, none failed." if code == 0 else "1 of 4 checks failed.") in result.output
    assert "Actions joint_angle" in result.output


def test_warnings_and_failures_are_counted(capsys, snapshot):
    kinds = ("pass", "warn", "note", "fail", "warn")
    results = [CheckResult(f"check {kind}", kind, "[x].") for kind in kinds]

    for end in (5, 3, 1):
        print_check_results(results[:end], Console(width=80))

    assert capsys.readouterr().out == snapshot


class Versioned(Sound):
    version = "step 3000"
    deterministic = False  # it says so


def test_the_version_that_records_will_have_is_printed():
    assert "step 3000" in found(f"{__name__}:Versioned", "pass")["version"]
    assert "Not checked" in found(Versioned(), "note")["reset forgets"]
    assert "set the attribute version" in found(Sound(), "note")["version"]
