import dataclasses
import itertools
from pathlib import Path

import pytest
from made_records import fill
from msgspec.structs import replace
from run_fakes import FakePlay, fake_run, small_plan

from roboirg.core.errors import InvalidValueError
from roboirg.records.episode_log import log_path
from roboirg.records.merging import merge_runs
from roboirg.records.record_codec import StoreError, identity_key
from roboirg.records.run_files import PLAN_FILE, earlier_plans
from roboirg.records.store import read_records


def played_records(count=4):
    """Return records of so many episodes, each in explicit and in direct."""
    return [FakePlay()(job) for job in small_plan(count).jobs()]


def merge_records(folder, *runs):
    """Merge runs with these records, each run a list, into the folder `out` of a folder."""
    sources = [fill(folder / str(number), *records) for number, records in enumerate(runs)]
    return merge_runs(sources, folder / "out")


def test_merging_two_parts_of_a_run_gives_the_whole_without_duplicates(tmp_path):
    """Of 8 records the parts have the first 5 and the last 5. So 8 are added, and 2 come a second
    time.
    """
    records = tuple(played_records())

    merged = merge_records(tmp_path, records[:5], records[3:])

    assert (merged.added, merged.duplicates, merged.conflicts) == (8, 2, [])
    assert read_records(tmp_path / "out") == records


def test_merging_again_into_the_same_folder_adds_nothing(tmp_path):
    """The part has eight records, which are all there already."""
    part = fill(tmp_path / "a", *played_records())
    merge_runs([part], tmp_path / "out")

    again = merge_runs([part], tmp_path / "out")

    assert (again.added, again.duplicates) == (0, 8)


def test_the_plan_of_a_merged_run_is_kept(tmp_path):
    """The plan lists the episodes of a run; without it nobody could count what is missing."""
    part = tmp_path / "part"
    fake_run(part)

    merge_runs([part], tmp_path / "out")

    (plan,) = earlier_plans(tmp_path / "out")
    assert plan.read_bytes() == (part / PLAN_FILE).read_bytes()


def test_merging_keeps_a_verdict_rather_than_an_error(tmp_path):
    """Three runs have a record of the same episode: an error, a success, and the error again.
    Whichever comes first, the success is kept.
    """
    won = played_records()[0]
    error = replace(won, outcome="error", error="connection", server_version=None)

    merged = merge_records(tmp_path, [error], [won], [error])

    assert read_records(tmp_path / "out") == (won,)
    assert (merged.added, merged.duplicates, merged.conflicts) == (1, 2, [])


def test_merging_keeps_the_first_of_two_errors(tmp_path):
    """Both runs have an error of the same episode, with different causes."""
    usual = played_records()[0]
    first = replace(usual, outcome="error", error="connection", cause="connection: refused")
    second = replace(first, cause="connection: lost")

    merge_records(tmp_path, [first], [second])

    assert read_records(tmp_path / "out") == (first,)


def test_merging_keeps_the_first_of_two_verdicts_and_reports_the_other_as_a_conflict(tmp_path):
    """Both runs have a verdict on the same episode: it failed in the first one and was won in the
    second.
    """
    record = played_records()[1]
    fell = replace(record, outcome="failure", cause="it fell")
    won = replace(record, outcome="success", cause=None)

    merged = merge_records(tmp_path, [fell], [won])

    assert read_records(tmp_path / "out") == (fell,)
    (conflict,) = merged.conflicts
    assert (identity_key(conflict), conflict.outcome) == (identity_key(record), "success")


def test_merging_warns_of_verdicts_by_other_code(tmp_path):
    """`verdict_code` is a digest of the code that judged an episode; one of the two runs has
    another.
    """
    first, second, *_ = played_records()
    by_other_code = replace(second, verdict_code="old")

    merged = merge_records(tmp_path, [first], [by_other_code])

    (warning,) = merged.warnings()
    assert warning.startswith(
        f"Mixed states of the code that decides verdicts: {first.verdict_code}, old."
    )


def test_merging_does_not_warn_of_other_code_in_episodes_without_instruction(tmp_path):
    """The verdict of a told episode and that of a silent one come of different states of the code.

    A warning is for results that are compared. A silent episode (the arm *silent*) is a control,
    in which nothing is said that could be understood.
    """
    told, silent, *_ = played_records()
    silent = replace(silent, arm="silent", verdict_code="older")

    merged = merge_records(tmp_path, [told], [silent])

    assert merged.added == 2
    assert not merged.warnings()


def test_videos_actions_and_logs_are_copied_with_the_records_that_are_kept(tmp_path):
    """Run a has an error of an episode, run b a verdict on it, which replaces the error. Both have
    a video, its picture, actions and a log, in files that say whose they are; those of b are
    copied.
    """
    record = replace(played_records()[0], video="videos/x.mp4", action_log="ab" * 32)
    error = replace(record, outcome="error", error="connection")
    files = (
        str(log_path(Path(), record.slug)),
        "videos/x.mp4",
        "videos/x.jpg",
        f"actions/ab/{'ab' * 32}.npz",
    )
    sources = [fill(tmp_path / "a", error), fill(tmp_path / "b", record)]
    for source, name in itertools.product(sources, files):
        (source / name).parent.mkdir(parents=True, exist_ok=True)
        (source / name).write_text(f"of run {source.name}")

    merge_runs(sources, tmp_path / "out")

    assert [(tmp_path / "out" / name).read_text() for name in files] == ["of run b"] * 4


def test_a_merged_record_whose_video_is_gone_has_none(tmp_path):
    merge_records(tmp_path, [replace(played_records()[0], video="videos/gone.mp4")])

    (record,) = read_records(tmp_path / "out")
    assert record.video is None


@pytest.mark.parametrize(
    ("field", "value", "words"),
    [
        ("language_version", "0.9", "episodes whose language version is 0.9, but in .* it is"),
        (
            "words",
            "PickXtimes/test@0a",
            "PickXtimes/test whose words version is PickXtimes/test@0a",
        ),
        ("server_version", "8", "random whose server version is 8, but in .* it is none; they"),
        ("seed", 5, "PickXtimes test 0 whose seed is 5"),
    ],
)
def test_runs_of_other_words_servers_or_scenes_are_not_merged(tmp_path, field, value, words):
    """Two runs have a record of the same episode, in one of them with another `value` of a field on
    which its result depends. They are merged neither into a new folder nor the odd one into the
    usual one.
    """
    record = replace(played_records()[0], words="PickXtimes/test@1b")
    usual = fill(tmp_path / "usual", record)
    odd = fill(tmp_path / "odd", replace(record, **{field: value}))

    with pytest.raises(StoreError, match=f"{words}.* cannot be merged"):
        merge_runs([usual, odd], tmp_path / "out")
    with pytest.raises(StoreError, match=f"{words}.* cannot be merged"):
        merge_runs([odd], usual)

    assert not (tmp_path / "out").exists()


def test_a_run_is_not_merged_into_itself(tmp_path):
    folder = fill(tmp_path / "a", *played_records())
    with pytest.raises(InvalidValueError, match="is one of the runs"):
        merge_runs([folder], tmp_path / "b/../a")


def test_runs_with_two_wording_files_can_be_merged(tmp_path):
    """Each run has its sentences from a file of its own, with another digest. They are other
    episodes, so their words may differ.
    """
    usual = played_records()[0]
    folders = []
    for digest in ("0a", "1b"):
        options = dataclasses.replace(usual.options, wordings=f"mine@{digest}")
        record = replace(usual, options=options, words=f"PickXtimes/test@{digest}")
        folders.append(fill(tmp_path / digest, record))

    assert merge_runs(folders, tmp_path / "out").added == 2
