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

UNFAIR = [
    ({"split": "val"}, "Mixed splits: test, val."),
    ({"wordings": "mine@0a"}, "Mixed words: our own words, the words of mine@0a."),
    ({"max_steps": 9}, "Mixed step limits: 1300, 9."),
    ({"meshes": "light"}, "Mixed kinds of meshes: faithful, light."),
    ({"language_version": "2"}, "Mixed versions of the language: 1, 2."),
    ({"environment_version": 99}, "Mixed versions of the environment: 1, 99."),
]
WORDS = "PickXtimes/test@0a", "PickXtimes/test@1b"
APART = [
    ({"policy_version": "new"}, "Mixed versions of {}: new, unknown."),
    (
        {"policy_version": "new", "server_version": "8"},
        "Mixed versions of {}: new (server 8), unknown.",
    ),
    ({"demonstration_frames": 5}, "Mixed demonstration frames of {}: 5, None."),
]
AVERAGED = [
    ({"render_device": "H100"}, "Mixed render devices: H100, llvmpipe."),
    ({"verdict_code": "ab"}, "Mixed states of the code that decides verdicts: 0a, ab."),
    ({"package_version": "1"}, "Mixed versions of roboirg: 0, 1."),
]


@pytest.mark.parametrize("policy", ["listener", "other"])
@pytest.mark.parametrize(("fields", "sentence"), [*UNFAIR, *APART, *AVERAGED])
def test_each_difference_is_one_sentence(policy, fields, sentence):
    """With the same policy or another."""
    runs = two_runs(policy, fields)
    expected = [sentence.format(policy)]
    if "{}" in sentence and policy == "other":
        expected = []  # of two policies each has its own

    found = mixtures([*runs["a"], *runs["b"]])

    assert [words.partition(". ")[0] + "." for words in found] == expected

    frame = make_frame([*runs.items()])
    (table,) = with_mixtures([make_table("main", RunData(frame))], frame)
    assert list(table.notes[len(table.notes) - len(found) :]) == found
    assert len({row.name for row in table.rows}) == len(table.rows) == len(frame.names)


def two_runs(policy, fields):
    """Return results of two runs that differ in some fields, and the second in its policy."""
    usual = {"render_device": "llvmpipe", "verdict_code": "0a"}
    first = [make_result(episode=episode, **usual) for episode in range(2)]
    second = [make_result(episode=episode, policy=policy, **usual | fields) for episode in range(2)]
    not_rendered = make_result(episode=2)  # and what decides verdicts is not known: fits all
    return {"a": [*first, not_rendered], "b": second}


@pytest.mark.parametrize("fields", [fields for fields, _ in UNFAIR])
def test_what_would_be_unfair_is_not_compared(fields):
    runs = two_runs("other", fields)
    frame = make_frame([*runs.items()])
    (sentence,) = mixtures([*runs["a"], *runs["b"]])

    with pytest.raises(InvalidValueError, match="cannot be compared") as refused:
        compare(frame.where(policy="listener"), frame.where(policy="other"))
    assert str(refused.value) == sentence


@pytest.mark.parametrize("fields", [fields for fields, _ in (*APART, *AVERAGED)])
def test_policies_are_compared_over_devices_and_versions(fields):
    frame = make_frame([*two_runs("other", fields).items()])
    compare(frame.where(policy="listener"), frame.where(policy="other"))


@pytest.mark.parametrize(
    ("fields", "other_fields"),
    [
        ({"verdict_code": "0a"}, {"verdict_code": "0a", "package_version": "1"}),
        ({"verdict_code": "0a"}, {"verdict_code": None}),
    ],
)
def test_other_code_is_no_mixture_if_verdicts_are_decided_alike(fields, other_fields):
    """Known to be, or of the same version of the package, in earlier records."""
    assert not mixtures([make_result(code="0", **fields), make_result(code="1", **other_fields)])


def test_other_words_are_refused_where_task_and_pool_are_the_same_and_split_no_rows():
    first, same_task = (make_result(words=words) for words in WORDS)
    other_task = make_result(words="StopCube/test@2c", task="StopCube")

    (sentence,) = mixtures([first, other_task, same_task])

    with pytest.raises(InvalidValueError, match=sentence[:60]):
        compare(frame_of([first]), frame_of([same_task]))
    both = [("a", [first, other_task]), ("b", [make_result(words=WORDS[1], episode=1)])]
    assert len(make_frame(both).names) == 1


def test_words_are_mixed_in_one_task_and_pool_alone():
    first = make_result(words=WORDS[0])
    other_task = make_result(words="StopCube/test@2c", task="StopCube")
    own_words = make_result(words="PickXtimes/test/lab@3d", setting="lab")

    assert not mixtures([first, other_task, own_words])

    (sentence,) = mixtures([own_words, make_result(words="PickXtimes/test/lab@4e")])
    assert sentence.startswith("Mixed words of a task and pool: PickXtimes/test/lab@3d, Pick")

    other_words = make_result(words=WORDS[1], wordings="mine@0a")
    assert len(mixtures([first, other_words])) == 1, "that alone"
