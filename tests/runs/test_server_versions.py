"""Verdicts of two versions of a policy's server do not get into one folder, table or merge."""

import pytest
from made_records import make_record
from wire_servers import ChallengeServer

from roboirg.policies import make_policy
from roboirg.policies.contract.policy_calls import server_version
from roboirg.policies.planners.hierarchical_policy import HierarchicalPolicy
from roboirg.records.record_codec import StoreError
from roboirg.records.store import read_records
from roboirg.runs.plan.plan_maker import make_plan
from roboirg.runs.run.executor import InProcess
from roboirg.runs.run.runner import run_plan


class PlaysWithServerVersions:
    """Plays jobs with a policy's server that reports these versions, one for each episode.

    A server that does not tell its version counts as *unknown*.
    """

    def __init__(self, *versions):
        self.versions = list(versions)

    def __call__(self, job):
        version = self.versions.pop(0)
        if version == "refused":
            return make_record(job, cause="connection: refused", error="connection")
        metadata = {"server": "localhost:1", "version": version}
        told = server_version(metadata)
        return make_record(job, "success", policy_metadata=metadata, server_version=told)


def run_with_server_versions(count, folder, *versions):
    """Run a plan of some episodes, each tried once, with a server that reports these versions."""
    few = {"tasks": "PickXtimes", "settings": "explicit", "episodes": count, "tries": 1}
    run_plan(make_plan("random", **few), folder, PlaysWithServerVersions(*versions), InProcess())


def stored_server_versions(folder):
    return [record.server_version for record in read_records(folder)]


def test_a_run_stops_when_its_policys_server_reports_another_version(tmp_path):
    """The third of four episodes is answered by version b of the server instead of a.

    Results of two versions must not be mixed, so the third one is not stored.
    """
    with pytest.raises(StoreError, match=r"whose server version is a, but in random-.* it is b"):
        run_with_server_versions(4, tmp_path, "a", "a", "b", "a")

    assert stored_server_versions(tmp_path) == ["a", "a"]


def test_a_stopped_run_goes_on_with_the_version_of_the_server_with_which_it_began(tmp_path):
    """Two episodes are to be played. The first is stored, with version a of the server.

    The run stopped in the second one, as the server had changed to version b. Now it is a again.
    """
    with pytest.raises(StoreError):
        run_with_server_versions(2, tmp_path, "a", "b")

    run_with_server_versions(2, tmp_path, "a")

    assert stored_server_versions(tmp_path) == ["a", "a"]


@pytest.mark.parametrize(("version", "named"), [("b", "b"), ("unknown", "none")])
def test_a_stopped_run_does_not_go_on_with_another_or_an_unknown_version_of_the_server(
    tmp_path, version, named
):
    """Two episodes are to be played. The first is stored, with version a of the server.

    The run stopped in the second one, as the server had changed to version b. Now the server
    reports version b again, or none at all; the second episode is not stored.
    """
    with pytest.raises(StoreError):
        run_with_server_versions(2, tmp_path, "a", "b")

    with pytest.raises(StoreError, match=f"server version is a, but in .* it is {named}; choose"):
        run_with_server_versions(2, tmp_path, version)

    assert stored_server_versions(tmp_path) == ["a"]


def test_a_server_version_with_terminal_codes_is_stored_escaped(tmp_path):
    r"""A server reports a version that begins with the codes to clear a terminal (ESC [ 2 J).

    Printed as it is, it would do so to whoever reads the record; the file has a backslash and "x1b"
    instead. U+202E, which turns the direction of writing, is escaped likewise.
    """
    version = "\x1b[2J\u202e" + "9" * 5000

    run_with_server_versions(1, tmp_path, version)

    (stored,) = stored_server_versions(tmp_path)
    assert stored.startswith(r"\x1b[2J\u202e")


def test_an_episode_without_a_connection_has_no_server_version_that_could_differ(tmp_path):
    """Of three episodes the first and the last find no server; each is tried once.

    They have the version of the episode that was played, so all three may lie in one folder.
    """
    run_with_server_versions(3, tmp_path, "refused", "a", "refused")

    assert stored_server_versions(tmp_path) == ["a"] * 3


class PlannerWithVersion:
    """A planner of this process."""

    version = "7"
    metadata = {"version": "7"}  # noqa: RUF012

    def reset(self, instruction, demonstration):
        pass


@pytest.fixture
def client_of_server_phase_1():
    """A policy that asks a server, which is called version "mine" here; the server is "phase-1"."""
    with ChallengeServer() as server:
        client = make_policy(f"challenge://{server.place}?version=mine", 0)
        client.reset("go", {})
        yield client
        client.close()


def test_the_server_version_is_that_which_the_server_reports_and_not_that_given_to_its_client(
    client_of_server_phase_1,
):
    """The server reports version "phase-1"; the user who connects to it called it "mine"."""
    assert server_version(client_of_server_phase_1.metadata) == "phase-1"


def test_the_server_version_of_a_hierarchical_policy_is_not_the_version_of_its_planner(
    client_of_server_phase_1,
):
    """A planner with version "7" names subgoals; the policy that follows them asks a server, which
    reports version "phase-1"."""
    client_of_server_phase_1.follow = print  # what can follow subgoals has this method
    policy = HierarchicalPolicy(PlannerWithVersion(), client_of_server_phase_1)

    assert server_version(policy.metadata) == "phase-1"


@pytest.mark.parametrize(
    "metadata",
    [{}, {"version": "1"}, {"server": "x"}, {"server": "x", "version": "unknown"}],
    ids=["nothing", "a version without a server", "no version", "an unknown version"],
)
def test_metadata_without_a_server_and_its_version_give_no_server_version(metadata):
    """What a policy reports of itself (its metadata) must have both, and the version be known."""
    assert server_version(metadata) is None
