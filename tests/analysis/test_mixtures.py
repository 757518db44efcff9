"""What results do not have in common: kept apart, named once, and refused in a comparison."""

from __future__ import annotations

import pytest

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.results.frame import make_frame
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.paper_tables import make_table
from roboirg.evaluation.analysis.tables.table_notes import with_mixtures
from roboirg.evaluation.records.mixing import mixtures

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
    ({"code": "ab"}, "Mixed states of the package's code: ab, unknown."),
]


@pytest.mark.parametrize("policy", ["listener", "other"])
@pytest.mark.parametrize(("fields", "sentence"), [*UNFAIR, *APART, *AVERAGED])
def test_each_difference_is_one_sentence(result, policy, fields, sentence) -> None:
    """With the same policy or another."""
    usual = {"render_device": "llvmpipe"}
    first = [result(episode=episode, **usual) for episode in range(2)]
    second = [result(episode=episode, policy=policy, **usual | fields) for episode in range(2)]
    runs = [("a", [*first, result(episode=2)]), ("b", second)]  # nothing was rendered: fits all
    is_of_policy, is_same = "{}" in sentence, policy == "listener"
    expected = [] if is_of_policy and not is_same else [sentence.format(policy)]
    found = mixtures([one for _, results in runs for one in results])
    assert [one.partition(". ")[0] + "." for one in found] == expected
    frame = make_frame(runs)
    (table,) = with_mixtures([make_table("main", RunData(frame))], frame)
    assert [*table.notes[-len(found) :]] * bool(found) == found
    assert len({row.name for row in table.rows}) == len(table.rows) == len(frame.names)
    if not is_same:
        sides = [frame.where(policy=one) for one in ("listener", "other")]
        if (fields, sentence) in UNFAIR:
            with pytest.raises(InvalidValueError, match="cannot be compared") as refused:
                compare(*sides)
            assert str(refused.value) == found[0]
        else:
            compare(*sides)


def test_other_words_are_refused_where_task_and_pool_are_the_same_and_split_no_rows(result) -> None:
    first, same_task = (result(words=words, language=4) for words in WORDS)
    other_task = result(words="StopCube/test@2c", task="StopCube", language=4)
    no_words = result(episode=1)  # a language whose words are code
    own_words = result(words="PickXtimes/test/lab@3d", setting="lab", language=4)
    assert not mixtures([first, other_task, no_words, own_words])
    (sentence,) = mixtures([own_words, result(words="PickXtimes/test/lab@4e", language=4)])
    assert sentence.startswith("Mixed words of a task and pool: PickXtimes/test/lab@3d, Pick")
    unnamed = result(language=4, episode=1)
    assert mixtures([first, unnamed])[0].startswith("Mixed words of a task and pool: PickX")
    (sentence,) = mixtures([first, other_task, same_task])
    assert sentence == (
        "Mixed words of a task and pool: PickXtimes/test@0a, PickXtimes/test@1b. They cannot be "
        "compared, and rates average over them."
    )
    both = [("a", [first, other_task]), ("b", [result(words=WORDS[1], language=4, episode=1)])]
    assert len(make_frame(both).names) == 1
    frames = [make_frame([("a", [one])]) for one in (first, same_task)]
    with pytest.raises(InvalidValueError, match=sentence[:60]):
        compare(*frames)
