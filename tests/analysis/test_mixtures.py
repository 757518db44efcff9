"""What results do not have in common: kept apart, named once, and refused in a comparison."""

import pytest
from flat_jobs import frame_of, make_result

from roboirg.analysis.measures.comparison import compare
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import make_frame
from roboirg.analysis.tables.paper_tables import make_table
from roboirg.analysis.tables.table_notes import with_mixtures
from roboirg.core.errors import InvalidValueError
from roboirg.records.mixing import mixtures

DIFFERENCES_THAT_FORBID_A_COMPARISON = [
    ({"split": "val"}, "Mixed splits: test, val."),
    ({"wordings": "mine@0a"}, "Mixed words: our own words, the words of mine@0a."),
    ({"max_steps": 9}, "Mixed step limits: 1300, 9."),
    ({"meshes": "light"}, "Mixed kinds of meshes: faithful, light."),
    ({"language_version": "2"}, "Mixed versions of the language: 1, 2."),
    ({"environment_version": 99}, "Mixed versions of the environment: 1, 99."),
]
TWO_DIGESTS_OF_WORDS = "PickXtimes/test@0a", "PickXtimes/test@1b"
DIFFERENCES_OF_ONE_POLICY = [
    ({"policy_version": "new"}, "Mixed versions of listener: new, unknown."),
    (
        {"policy_version": "new", "server_version": "8"},
        "Mixed versions of listener: new (server 8), unknown.",
    ),
    ({"demonstration_frames": 5}, "Mixed demonstration frames of listener: 5, None."),
]
DIFFERENCES_THAT_ARE_POOLED = [
    ({"render_device": "H100"}, "Mixed render devices: H100, llvmpipe."),
    ({"verdict_code": "ab"}, "Mixed states of the code that decides verdicts: 0a, ab."),
    ({"package_version": "1"}, "Mixed versions of roboirg: 0, 1."),
]


@pytest.mark.parametrize("policy", ["listener", "other"])
@pytest.mark.parametrize(
    ("fields", "sentence"),
    [*DIFFERENCES_THAT_FORBID_A_COMPARISON, *DIFFERENCES_THAT_ARE_POOLED],
)
def test_each_difference_between_two_runs_is_named_in_one_sentence_below_the_table(
    policy, fields, sentence
):
    """Whether the other run is of the same policy, the listener, or of another one."""
    assert notes_on_mixtures(two_runs_that_differ_in(policy, fields)) == [sentence]


@pytest.mark.parametrize(("fields", "sentence"), DIFFERENCES_OF_ONE_POLICY)
def test_a_difference_within_a_policy_is_named_and_one_between_two_policies_is_not(
    fields, sentence
):
    """Of two policies each has its own version anyway."""
    same_policy = two_runs_that_differ_in("listener", fields)
    two_policies = two_runs_that_differ_in("other", fields)

    assert notes_on_mixtures(same_policy) == [sentence]
    assert notes_on_mixtures(two_policies) == []


def notes_on_mixtures(runs):
    """Return the first sentence of each note on what runs do not have in common.

    These notes stand last below the table, which has a row for each name of a policy run.
    """
    frame = make_frame([*runs.items()])
    found = mixtures([*runs["a"], *runs["b"]])

    (table,) = with_mixtures([make_table("main", RunData(frame))], frame)

    assert list(table.notes[len(table.notes) - len(found) :]) == found
    assert len({row.name for row in table.rows}) == len(table.rows) == len(frame.names)
    return [words.partition(". ")[0] + "." for words in found]


def two_runs_that_differ_in(policy, fields):
    """Return results of two runs: `a` of the listener, `b` of a policy and with other fields.

    One result of `a` was not rendered, and what decides its verdict is not known: it fits all.
    """
    usual = {"render_device": "llvmpipe", "verdict_code": "0a"}
    first = [make_result(episode=episode, **usual) for episode in range(2)]
    second = [make_result(episode=episode, policy=policy, **usual | fields) for episode in range(2)]
    return {"a": [*first, make_result(episode=2)], "b": second}


@pytest.mark.parametrize("fields", [fields for fields, _ in DIFFERENCES_THAT_FORBID_A_COMPARISON])
def test_runs_with_other_splits_words_limits_or_meshes_are_not_compared(fields):
    """The refusal is the sentence that names the difference. Would find an unfair comparison."""
    runs = two_runs_that_differ_in("other", fields)
    frame = make_frame([*runs.items()])
    (sentence,) = mixtures([*runs["a"], *runs["b"]])

    with pytest.raises(InvalidValueError, match="cannot be compared") as refused:
        compare(frame.where(policy="listener"), frame.where(policy="other"))
    assert str(refused.value) == sentence


@pytest.mark.parametrize(
    "fields", [fields for fields, _ in (*DIFFERENCES_OF_ONE_POLICY, *DIFFERENCES_THAT_ARE_POOLED)]
)
def test_runs_on_other_devices_or_of_other_policy_versions_are_compared(fields):
    frame = make_frame([*two_runs_that_differ_in("other", fields).items()])
    compare(frame.where(policy="listener"), frame.where(policy="other"))


@pytest.mark.parametrize(
    ("fields", "other_fields"),
    [
        ({"verdict_code": "0a"}, {"verdict_code": "0a", "package_version": "1"}),
        ({"verdict_code": "0a"}, {"verdict_code": None}),
    ],
)
def test_a_change_of_code_is_not_reported_if_the_code_that_decides_verdicts_is_the_same(
    fields, other_fields
):
    """Known from its digest; or assumed of one package version, in records that lack the digest."""
    assert not mixtures([make_result(code="0", **fields), make_result(code="1", **other_fields)])


def test_results_of_one_task_in_other_words_are_not_compared():
    """Words are known by a digest for each task; the refusal names both."""
    first = make_result(words=TWO_DIGESTS_OF_WORDS[0])
    second = make_result(words=TWO_DIGESTS_OF_WORDS[1])
    (sentence,) = mixtures([first, second])

    with pytest.raises(InvalidValueError, match=sentence[:60]):
        compare(frame_of([first]), frame_of([second]))


def test_results_of_one_task_in_other_words_are_pooled_in_a_table():
    first = make_result(words=TWO_DIGESTS_OF_WORDS[0])
    second = make_result(words=TWO_DIGESTS_OF_WORDS[1], episode=1)

    assert len(make_frame([("a", [first]), ("b", [second])]).names) == 1


def test_words_are_mixed_only_if_they_are_of_the_same_task_and_setting():
    """Another task, or a setting of another package ("lab"), has words of its own anyway."""
    first = make_result(words=TWO_DIGESTS_OF_WORDS[0])
    other_task = make_result(words="StopCube/test@2c", task="StopCube")
    own_words = make_result(words="PickXtimes/test/lab@3d", setting="lab")

    assert not mixtures([first, other_task, own_words])


def test_two_digests_of_the_words_of_a_setting_are_mixed():
    first = make_result(words="PickXtimes/test/lab@3d", setting="lab")
    second = make_result(words="PickXtimes/test/lab@4e")

    (sentence,) = mixtures([first, second])

    assert sentence.startswith("Mixed words of a task and pool: PickXtimes/test/lab@3d, Pick")


def test_words_of_a_file_are_reported_once_although_their_digest_differs_too():
    first = make_result(words=TWO_DIGESTS_OF_WORDS[0])
    other_words = make_result(words=TWO_DIGESTS_OF_WORDS[1], wordings="mine@0a")

    assert len(mixtures([first, other_words])) == 1
