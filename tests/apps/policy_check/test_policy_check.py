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
    """Its actions have seven numbers; they should have eight."""

    def act(self, observation):
        return np.zeros((3, 7))


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
    """Each call draws other actions, from no seed."""

    def act(self, observation):
        return np.random.default_rng().uniform(-1, 1, (4, 8))


class HonestDice(Dice):
    """Acts at random, says so, and has a version that says nothing."""

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


def messages(policy, verdict):
    """Check a policy; return the messages of the checks with a verdict, by the checks' names."""
    results = check_policy(policy)
    return {result.check: result.message for result in results if result.verdict == verdict}


def test_depth_and_matrices_are_named_if_a_policy_wants_them():
    """`Calibrated` has the attributes depth and calibration, so its requirements name both."""
    requirements = messages(f"{__name__}:Calibrated", "pass")["requirements"]
    assert requirements.endswith("observations every 1, depth, calibration.")


def test_a_policy_of_waypoints_is_not_compared_with_the_expert():
    """A waypoint has no action of the expert to compare with; the recorder, `print`, isn't
    called.
    """
    *_, result = check_policy(f"{__name__}:Waypoints", record_expert=print)
    assert result == ("expert", "note", "Not checked: a waypoint takes many control steps.")


def test_a_sound_policy_passes_everything():
    """`Sound` keeps the contract: all eight checks pass, in this order, and none is only noted."""
    results = check_policy(f"{__name__}:Sound", seed=3)

    assert [(result.check, result.verdict) for result in results] == [
        ("loads", "pass"),
        ("requirements", "pass"),
        ("version", "pass"),
        ("acts without a video", "pass"),
        ("acts with a video", "pass"),
        ("reports", "pass"),
        ("deterministic", "pass"),
        ("reset forgets", "pass"),
    ]


def test_the_check_says_with_which_seed_a_policy_was_made_and_how_it_acts():
    """`Sound` is asked three times and gives five actions of eight numbers each time."""
    loads, _, _, acts, *_ = check_policy(f"{__name__}:Sound", seed=3)

    assert "made with seed 3" in loads.message
    assert "5, 5, 5 actions of 8 numbers, float64" in acts.message


def test_an_object_is_checked_like_a_policy_that_is_named():
    assert messages(Sound(), "fail") == {}


@pytest.mark.parametrize(
    ("kind", "check", "words"),
    [
        (Shapeless, "acts without a video", "expected shape (n, 8) with n >= 1, got shape (3, 7)"),
        (Raising, "acts without a video", "'depth'; the observation has end_effector, front_rgb,"),
        (Elephant, "reset forgets", "value 0 of row 0 in answer 1: expected 0.01, got 0.16"),
        (Dice, "deterministic", " in answer "),
        (Growing, "deterministic", "answer 1: expected 4 actions, got 7"),
        (Unwritable, "reports", "the policy's metadata: 'rate' is nan; it must be a text"),
        (Priceless, "reports", "usage() has None as 'calls'; it must be a number."),
    ],
)
def test_the_check_that_finds_a_mistake_says_what_was_expected(kind, check, words):
    """Each class has one mistake, which its name says."""
    failed = messages(f"{__name__}:{kind.__name__}", "fail")
    assert words in failed[check]


def test_noise_that_a_policy_declares_is_noted_and_no_failure():
    """`HonestDice` acts at random, and says so by `deterministic = False`."""
    policy = f"{__name__}:HonestDice"

    assert "as the policy declares" in messages(policy, "note")["deterministic"]
    assert messages(policy, "fail") == {}


@pytest.mark.parametrize("policy", [HonestDice(), Sound()], ids=["unknown", "none"])
def test_a_policy_without_a_version_is_advised_to_set_one(policy):
    """`HonestDice` has the version "unknown", and `Sound` has none."""
    assert "set the attribute version" in messages(policy, "note")["version"]


def test_actions_out_of_the_usual_range_are_noted():
    """`Reckless` has 9 in one number of its second action, in two of the third, three of the last.

    So three of four actions are out of range, and nine of twelve after three answers. Value 1 has
    the narrowest range, up to 1.76 rad, so it is the farthest; action 2 is the first with it.
    """
    notes = messages(f"{__name__}:Reckless", "note")
    assert notes["range without a video"] == (
        "9 of 12 actions have a number outside the usual range of joint_angle; farthest is value 1 "
        "of action 2: expected -1.76 to 1.76, got 9. The robot executes them as well as it can."
    )


def test_a_privileged_policy_is_noted():
    """The policy `oracle` reads the goal from the simulator."""
    assert "It is privileged" in messages("oracle", "note")["loads"]


@pytest.mark.parametrize(
    ("spec", "words"),
    [
        ("nothing", "There is no policy 'nothing'"),
        ("openpi://127.0.0.1:9?connect=0.1", "cannot be reached"),
        ("openpi://127.0.0.1:9?conect=0.1", "Did you mean 'connect'?"),
        (object(), "Expected reset() and act(), got no reset()."),
    ],
)
def test_a_policy_that_cannot_be_tried_fails_with_the_reason(spec, words):
    """One check fails, with these words: nothing else can be checked."""
    (message,) = messages(spec, "fail").values()
    assert words in message


@pytest.fixture
def check_my_policy(tmp_path, monkeypatch):
    """Run the command on a class of the current folder that always gives two actions of a value.

    The value is an expression, with NumPy as np; the simulator's expert is not asked.
    """
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.delitem(sys.modules, "my_policy", raising=False)
    monkeypatch.setenv("COLUMNS", "200")
    app = typer.Typer()
    app.command()(command)

    def check(value):
        (tmp_path / "my_policy.py").write_text(
            "import numpy as np\nclass Mine:\n    def reset(self, i, d): pass\n"
            f"    def act(self, o): return np.full((2, 8), {value})\n"
        )
        return CliRunner().invoke(app, ["my_policy:Mine", "--no-expert"])

    return check


def test_the_command_prints_a_table_of_checks_and_exits_with_0_if_none_failed(check_my_policy):
    """Actions of zeros keep the contract; `Actions joint_angle` is in the line of one check."""
    result = check_my_policy("0.0")

    assert result.exit_code == 0, result.output
    assert "9 checks, none failed." in result.output
    assert "Actions joint_angle" in result.output


def test_the_command_exits_with_2_if_a_check_failed(check_my_policy):
    """Actions of NaN fail one check; five of the nine need finite actions and are not made."""
    result = check_my_policy("np.nan")

    assert result.exit_code == 2, result.output
    assert "1 of 4 checks failed." in result.output


@pytest.mark.parametrize(
    ("verdicts", "summary"),
    [
        (["pass"], "1 check, none failed."),
        (["pass", "warn", "note"], "3 checks, none failed, 1 warning."),
        (["pass", "warn", "note", "fail", "warn"], "1 of 5 checks failed, 2 warnings."),
    ],
)
def test_results_are_printed_as_a_table_and_warnings_and_failures_are_counted(
    capsys, verdicts, summary
):
    """Messages are "[x].", which is no markup and so printed as it is.

    The last line counts checks, failures and warnings; notes are not counted.
    """
    results = [CheckResult(f"check {verdict}", verdict, "[x].") for verdict in verdicts]

    print_check_results(results, Console(width=80))

    head, first, *_, last = capsys.readouterr().out.splitlines()
    assert head.split() == ["check", "result"]
    assert first.split() == ["check", "pass", "pass", "[x]."]
    assert last == summary


class Versioned(Sound):
    version = "step 3000"
    deterministic = False  # it says so


def test_the_version_that_records_will_have_is_printed():
    """`Versioned` has the version "step 3000"."""
    assert "step 3000" in messages(f"{__name__}:Versioned", "pass")["version"]


def test_what_reset_forgets_is_not_checked_of_a_policy_with_noise():
    """`Versioned` says that it is not deterministic, so answers after a reset may differ."""
    assert "Not checked" in messages(Versioned(), "note")["reset forgets"]
