"""What results do not have in common: kept apart, named once, and refused in a comparison."""

import re

import pytest
from flat_jobs import frame_of, make_result

from roboirg.analysis.measures.comparison import compare
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import make_frame
from roboirg.analysis.tables.paper_tables import make_table
from roboirg.analysis.tables.table_notes import with_mixtures
from roboirg.core.errors import InvalidValueError
from roboirg.records.mixing import mixtures

UNFAIR_DIFFERENCES = [
    pytest.param({"split": "val"}, "Mixed splits: test, val.", id="split"),
    pytest.param(
        {"wordings": "mine@0a"}, "Mixed words: our own words, the words of mine@0a.", id="words"
    ),
    pytest.param({"max_steps": 9}, "Mixed step limits: 1300, 9.", id="step limit"),
    pytest.param({"meshes": "light"}, "Mixed kinds of meshes: faithful, light.", id="meshes"),
    pytest.param({"language_version": "2"}, "Mixed versions of the language: 1, 2.", id="language"),
    pytest.param(
        {"environment_version": 99}, "Mixed versions of the environment: 1, 99.", id="environment"
    ),
]
"""Fields of a run that differ from the usual ones, and how the difference is named."""
FAIR_DIFFERENCES = [
    pytest.param(
        {"render_device": "H100"}, "Mixed render devices: H100, llvmpipe.", id="render device"
    ),
    pytest.param(
        {"verdict_code": "ab"},
        "Mixed states of the code that decides verdicts: 0a, ab.",
        id="code of verdicts",
    ),
    pytest.param({"package_version": "1"}, "Mixed versions of roboirg: 0, 1.", id="package"),
]


def results_of(policy, **fields):
    """Return two results of a policy, with the usual fields or with others."""
    usual = {"render_device": "llvmpipe", "verdict_code": "0a"}
    return [make_result(episode=episode, policy=policy, **usual | fields) for episode in range(2)]


def notes_on_mixtures(first, second):
    """Return the first sentence of each note below a table on what two runs have not in common.

    Names of policies are told apart in the table: a row for each.
    """
    frame = make_frame([("a", first), ("b", second)])
    (table,) = with_mixtures([make_table("main", RunData(frame))], frame)
    notes = [note for note in table.notes if note.startswith("Mixed ")]
    return [note.partition(". ")[0] + "." for note in notes]


@pytest.mark.parametrize(("fields", "sentence"), [*UNFAIR_DIFFERENCES, *FAIR_DIFFERENCES])
def test_each_difference_between_two_runs_is_named_in_one_sentence_below_the_table(
    fields, sentence
):
    """One result was not rendered, and what decides its verdict is not known: it fits all."""
    listener = [*results_of("listener"), make_result(episode=2)]
    other = results_of("other", **fields)

    assert notes_on_mixtures(listener, other) == [sentence]


@pytest.mark.parametrize(
    ("fields", "sentence"),
    [
        pytest.param({"split": "val"}, "Mixed splits: test, val.", id="split"),
        pytest.param(
            {"policy_version": "new"}, "Mixed versions of listener: new, unknown.", id="version"
        ),
        pytest.param(
            {"policy_version": "new", "server_version": "8"},
            "Mixed versions of listener: new (server 8), unknown.",
            id="version on a server",
        ),
        pytest.param(
            {"demonstration_frames": 5},
            "Mixed demonstration frames of listener: 5, None.",
            id="frames of the video",
        ),
    ],
)
def test_a_difference_within_a_policy_is_named(fields, sentence):
    """Two runs of the policy *listener* differ in these fields of their results.

    The usual results come from the split *test* and say nothing of version, server and frames.
    """
    first = results_of("listener")
    second = results_of("listener", **fields)

    assert notes_on_mixtures(first, second) == [sentence]


@pytest.mark.parametrize(
    "fields",
    [{"policy_version": "new"}, {"demonstration_frames": 5}],
    ids=["version", "frames of the video"],
)
def test_two_policies_may_have_a_version_each(fields):
    """Only versions or frames of one policy would be a mixture."""
    listener = results_of("listener")
    other = results_of("other", **fields)

    assert notes_on_mixtures(listener, other) == []


def test_runs_of_one_policy_with_other_step_limits_have_a_row_each():
    """The usual limit is 1300 control steps; the second run has 9. Would find a mean of both."""
    frame = make_frame([("a", results_of("listener")), ("b", results_of("listener", max_steps=9))])

    table = make_table("main", RunData(frame))

    assert [row.name for row in table.rows] == [
        "listener, max steps 1300",
        "listener, max steps 9",
    ]


@pytest.mark.parametrize(("fields", "sentence"), UNFAIR_DIFFERENCES)
def test_runs_with_other_splits_words_limits_or_meshes_are_not_compared(fields, sentence):
    """The refusal begins with the sentence that names the difference."""
    listener = frame_of(results_of("listener"))
    other = frame_of(results_of("other", **fields))

    with pytest.raises(InvalidValueError, match=re.escape(sentence)):
        compare(listener, other)


@pytest.mark.parametrize(
    "fields",
    [{"render_device": "H100"}, {"policy_version": "new"}],
    ids=["render device", "version"],
)
def test_runs_on_other_devices_or_of_other_policy_versions_are_compared(fields):
    """A device draws nearly the same pictures, and two versions are what one wants to compare."""
    listener = frame_of(results_of("listener"))
    other = frame_of(results_of("other", **fields))

    comparison = compare(listener, other)

    assert comparison.averages


@pytest.mark.parametrize(
    "other_fields",
    [
        {"verdict_code": "0a", "package_version": "1"},
        {"verdict_code": None},
    ],
    ids=["same digest", "no digest, same package version"],
)
def test_a_change_of_code_is_not_reported_if_the_code_that_decides_verdicts_is_the_same(
    other_fields,
):
    """Known from its digest; or assumed of one package version, in records that lack the digest."""
    first = make_result(code="0", verdict_code="0a")
    second = make_result(code="1", **other_fields)

    assert not mixtures([first, second])


def test_results_of_one_task_in_other_words_are_not_compared():
    """Words are known by a digest for each task, here 0a and 1b."""
    old = frame_of([make_result(words="PickXtimes/test@0a")])
    new = frame_of([make_result(words="PickXtimes/test@1b")])

    with pytest.raises(InvalidValueError, match="PickXtimes/test@0a, PickXtimes/test@1b"):
        compare(old, new)


def test_results_of_one_task_in_other_words_are_pooled_in_a_table():
    """They are one policy with one name, to which a note is added; only a comparison is refused."""
    old = make_result(words="PickXtimes/test@0a")
    new = make_result(words="PickXtimes/test@1b", episode=1)

    assert len(make_frame([("a", [old]), ("b", [new])]).names) == 1


def test_words_are_mixed_only_if_they_are_of_the_same_task_and_setting():
    """Another task, or a setting of another package ("lab"), has words of its own anyway."""
    first = make_result(words="PickXtimes/test@0a")
    other_task = make_result(words="StopCube/test@2c", task="StopCube")
    own_words = make_result(words="PickXtimes/test/lab@3d", setting="lab")

    assert not mixtures([first, other_task, own_words])


def test_two_digests_of_the_words_of_a_setting_are_mixed():
    """3d and 4e are digests of the words of the setting *lab*, of two states of its package."""
    first = make_result(words="PickXtimes/test/lab@3d", setting="lab")
    second = make_result(words="PickXtimes/test/lab@4e")

    (sentence,) = mixtures([first, second])

    assert sentence.startswith("Mixed words of a task and pool: PickXtimes/test/lab@3d, Pick")


def test_words_of_a_file_are_reported_once_although_their_digest_differs_too():
    """The second result has the words of a file (mine@0a), the reason for its other digest."""
    first = make_result(words="PickXtimes/test@0a")
    other_words = make_result(words="PickXtimes/test@1b", wordings="mine@0a")

    assert len(mixtures([first, other_words])) == 1
