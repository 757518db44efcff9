"""Exports that are stopped, killed, continued, or refused."""

import itertools
import json
import os
import signal
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import killed_export
import numpy as np
import pytest
import synthetic_trajectories
import yaml
from pyarrow import parquet

from roboirg.apps.demonstrations import export_plan, export_run
from roboirg.apps.demonstrations.dataset_reading import read_dataset
from roboirg.apps.demonstrations.export_plan import recording_jobs
from roboirg.core.episode import ENVIRONMENT_VERSION
from roboirg.core.errors import InvalidValueError
from roboirg.core.instruction_options import OPTION_NAMES
from roboirg.core.licenses import OWN_LICENSE, PICTURE_LICENSE, TERMS

HERE = Path(__file__).parent


def quiet(*_):
    """Report no progress."""


def contents(root):
    """Return every file but the card, which names the folder."""
    return {
        path.relative_to(root): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and path.name != "README.md"
    }


@pytest.mark.slow
def test_a_killed_export_continues_without_a_broken_file(tmp_path, synthetic):
    """A process of killed_export.py runs the same export, but is killed (signal 9) where its second
    file would appear; started again, it is killed at its fifth, eighth, ... until it ends.

    After each kill, what can be read is read without an error. The whole export has more than ten
    files, so there are several kills, and in the end they have made no difference.
    """
    whole = tmp_path / "whole"
    out = tmp_path / "killed"
    export_run.run_export(killed_export.PLAN, whole, 0, quiet)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE), *sys.path])}

    for killed_at_file in itertools.count(2, 3):
        command = [sys.executable, HERE / "killed_export.py", out, str(killed_at_file)]
        done = subprocess.run(command, env=environment, check=False)
        if (out / "meta/info.json").exists():
            assert list(read_dataset(out))
        if done.returncode == 0:
            break
        assert done.returncode == -signal.SIGKILL

    assert killed_at_file > 10
    assert contents(out) == contents(whole)


def test_a_stopped_export_goes_on_and_records_each_trajectory_once(
    tmp_path, synthetic, make_plan, monkeypatch
):
    """It is stopped after three of six trajectories (two tasks of three episodes).

    `played` has what was recorded before and after the stop: all six, none twice.
    """
    out = tmp_path / "data"
    played = []

    def record(episode, *args, **options):
        played.append((episode.task, episode.index))
        return synthetic_trajectories.record(episode, *args, **options)

    def record_three(*args, **options):
        if len(played) == 3:
            raise KeyboardInterrupt
        return record(*args, **options)

    monkeypatch.setattr(export_run, "record_trajectory", record_three)
    with pytest.raises(KeyboardInterrupt):
        export_run.run_export(make_plan(), out, 0, quiet)
    monkeypatch.setattr(export_run, "record_trajectory", record)
    export_run.run_export(make_plan(), out, 0, quiet)

    assert len(set(played)) == len(played) == 6
    assert not (out / export_run.WORK_FOLDER).exists()


def test_progress_counts_recorded_trajectories_with_their_size_and_written_episodes(
    tmp_path, synthetic, make_plan
):
    """Progress is told as what is done ("record" or "write"), how many, of how many, and the bytes
    until then. Six trajectories are recorded, of which four succeed and are written.

    Sizes are of all trajectories up to then, so each is larger than the one before.
    """
    progress = []
    export_run.run_export(make_plan(), tmp_path, 0, lambda *now: progress.append(now))

    assert progress[-1][:3] == ("write", 4, 4)
    sizes = [size for work, _, _, size in progress if work == "record"]
    assert sizes == sorted(set(sizes))


def test_kept_trajectories_serve_other_formats(tmp_path, synthetic, make_plan, monkeypatch):
    """Trajectories of the first export are kept in a folder of their own. The second export, in
    another format and setting, must record nothing: `record_trajectory` is None by then.

    Two tasks with two successes each are four episodes.
    """
    kept = tmp_path / "kept"
    export_run.run_export(make_plan(), tmp_path / "v3", 0, quiet, kept)
    monkeypatch.setattr(export_run, "record_trajectory", None)
    plan = make_plan(format="lerobot-v2.1", settings=("reasoning",))

    summary = export_run.run_export(plan, tmp_path / "v21", 0, quiet, kept)

    assert summary.recorded == 0
    assert summary.episodes == 4


@pytest.mark.parametrize(
    ("changes", "recorded"),
    [
        ({}, 0),
        ({"policy": "listener", "episodes": (0,), "forms": ("implicit", "resolved")}, 6),
        ({"outcomes": "all"}, 2),  # of failures no pictures were kept
    ],
    ids=["the same", "other words", "other outcomes"],
)
def test_kept_trajectories_of_other_outcomes_or_words_are_not_taken(
    tmp_path, synthetic, make_plan, changes, recorded
):
    """The oracle's trajectories of six episodes are kept, without pictures of the two failures.

    The same plan takes all. A listener hears the words, so its 6 are new: two tasks in explicit,
    and in direct in two forms. With failures asked for, those two are recorded again.
    """
    kept = tmp_path / "kept"
    export_run.run_export(make_plan(), tmp_path / "first", 0, quiet, kept)

    summary = export_run.run_export(make_plan(**changes), tmp_path / "second", 0, quiet, kept)

    assert summary.recorded == recorded


def test_kept_trajectories_of_another_world_are_not_taken(
    tmp_path, synthetic, make_plan, monkeypatch
):
    """The second export finds trajectories of an older version, so it records all six again."""
    kept = tmp_path / "kept"
    export_run.run_export(make_plan(), tmp_path / "first", 0, quiet, kept)
    monkeypatch.setattr(export_run, "ENVIRONMENT_VERSION", ENVIRONMENT_VERSION + 1)

    assert export_run.run_export(make_plan(), tmp_path / "second", 0, quiet, kept).recorded == 6


OTHER_EPISODES = {
    "task": "StopCube", "split": "val", "number": 1, "variation": 1, "policy": "forgetful",
}  # fmt: skip
OTHER_RECORDINGS = {
    "coding": "lossless-video", "video": True, "depth": True, "cameras": ("wrist",), "size": 64,
    "actions": "waypoint", "disturbed": True,
}  # fmt: skip
OTHER_WORDS = {
    "setting": "direct", "form": "resolved", "stages": (1, 5), "frame": "camera",
    "distractor": "competing", "distractors": 3, "wordings": "train", "delivery": "turns",
}  # fmt: skip
"""By the field of a recording job, of its `spec`, and of its `options`: another value."""


@pytest.fixture
def job(make_plan):
    """The first trajectory to be recorded for a listener, which hears the words."""
    ((job, _), *_) = recording_jobs(make_plan(policy="listener"))
    return job


def test_every_field_of_a_recording_and_of_words_has_another_value_here(job):
    """Or the test below would not try a field that was added."""
    assert set(OTHER_RECORDINGS) == set(job.spec._fields)
    assert set(OTHER_WORDS) == set(OPTION_NAMES)


def test_a_trajectorys_name_has_all_that_it_depends_on(job):
    """A kept trajectory is found by its name. Each field of a job in turn gets another value, and
    each such job has another name; else a plan could be given the trajectory of another one.
    """
    jobs = [job]
    for name, value in OTHER_EPISODES.items():
        jobs.append(replace(job, **{name: value}))
    for name, value in OTHER_RECORDINGS.items():
        jobs.append(replace(job, spec=job.spec._replace(**{name: value})))
    for name, value in OTHER_WORDS.items():
        if name != "distractors":  # without a kind of distractors their number says nothing
            jobs.append(replace(job, options=replace(job.options, **{name: value})))

    assert len({each.path(Path()) for each in jobs}) == len(jobs)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("language_label", lambda *_: "another"),
        ("ENVIRONMENT_VERSION", "another"),
        ("TRAJECTORY_VERSION", "another"),
    ],
)
def test_the_fingerprint_of_a_plan_of_an_export_follows_from_the_package_s_versions(
    make_plan, monkeypatch, name, value
):
    """An export that was stopped goes on only with the same fingerprint, so not after an update of
    the words (`language_label` names those of a task), the world, or the format of trajectories.
    """
    before = make_plan().fingerprint()

    monkeypatch.setattr(export_plan, name, value)

    assert make_plan().fingerprint() != before


@pytest.mark.parametrize(
    ("options", "statuses"),
    [({}, ["success"] * 4), ({"outcomes": "all"}, ["success", "failure", "success"] * 2)],
)
def test_failures_are_exported_only_on_request(export, options, statuses):
    """Of three episodes of two tasks the second of each fails, so four of six succeed."""
    assert [recorded.status for recorded in read_dataset(export(**options))] == statuses


def test_the_mean_of_next_success_is_the_share_of_steps_that_end_in_success(export):
    """Four of six synthetic episodes succeed, each in the last of its seven steps; `next.success`
    is 1 there and 0 in all other frames. With failures (`outcomes`), there are 6 * 7 frames.
    """
    root = export(outcomes="all")

    stats = json.loads((root / "meta/stats.json").read_text())["next.success"]

    assert stats["mean"] == pytest.approx([4 / (6 * synthetic_trajectories.STEPS)])


def test_variations_are_trajectories_of_their_own(export):
    """Episodes 0 and 2 succeed; variation n of each is n steps longer, as synthetic ones are."""
    found = list(read_dataset(export(tasks=("PickXtimes",), variations=3, disturbed=True)))
    assert [(recorded.name, len(recorded.actions)) for recorded in found] == [
        (f"PickXtimes/train/{episode}/{variation}", synthetic_trajectories.STEPS + variation)
        for episode in (0, 2)
        for variation in range(3)
    ]


def test_a_policy_is_recorded_in_every_setting(export):
    """A listener hears the words, so there is a trajectory for each of two settings.

    The oracle does not hear them, and is recorded once for all.
    """
    root = export(tasks=("PickXtimes",), policy="listener", episodes=(0,))

    assert [recorded.name for recorded in read_dataset(root)] == [
        "PickXtimes/train/0/0/explicit-implicit",
        "PickXtimes/train/0/0/direct-implicit",
    ]
    table = parquet.read_table(root / "meta/demonstrations.parquet")
    assert set(table["policy"].to_pylist()) == {"listener"}


@pytest.fixture
def disturbed_export(export):
    """The folder of one disturbed episode: what was executed is 1.0 less than what was meant."""
    return export(tasks=("PickXtimes",), episodes=(0,), settings=("explicit",), disturbed=True)


def test_the_action_of_a_disturbed_frame_is_what_should_have_been_done(disturbed_export):
    """In the synthetic episode what was executed is 1.0 less than what was meant, in each
    number.
    """
    (executed,) = read_dataset(disturbed_export)

    table = parquet.read_table(disturbed_export / "data/chunk-000/file-000.parquet")

    assert np.allclose(table["action"].to_pylist(), executed.actions + 1.0)
    assert np.array_equal(table["executed_action"].to_pylist(), executed.actions)


def test_disturbed_episodes_are_marked_on_the_card_and_in_the_table(disturbed_export):
    (row,) = parquet.read_table(disturbed_export / "meta/demonstrations.parquet").to_pylist()

    assert (row["disturbed"], row["actions"]) == (True, "joint_angle")
    assert "**disturbed**" in (disturbed_export / "README.md").read_text()


def test_a_complete_export_is_not_overwritten(export, make_plan):
    """The folder holds an export that is complete; the same plan is refused there."""
    root = export()
    with pytest.raises(InvalidValueError, match="complete export already"):
        export_run.run_export(make_plan(), root, 0, quiet)


def test_a_folder_of_something_else_is_not_written_to(tmp_path, make_plan):
    """A folder with a file that is no part of an export is refused before anything is written."""
    (tmp_path / "thesis.tex").touch()

    with pytest.raises(InvalidValueError, match="is not empty and no export"):
        export_run.run_export(make_plan(), tmp_path, 0, quiet)

    assert [path.name for path in tmp_path.iterdir()] == ["thesis.tex"]


def test_a_stopped_export_does_not_go_on_with_other_options(tmp_path, make_plan, monkeypatch):
    """The first export stops at its first recording, as `record_trajectory` is None.

    The second one, of one setting instead of two, finds what it began.
    """
    monkeypatch.setattr(export_run, "record_trajectory", None)
    with pytest.raises(TypeError):
        export_run.run_export(make_plan(), tmp_path, 0, quiet)

    with pytest.raises(InvalidValueError, match="started with other options"):
        export_run.run_export(make_plan(settings=("direct",)), tmp_path, 0, quiet)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"variations": 0}, "variations is 0; it must be a whole number from 1"),
        ({"variations": 2}, "variations is 2, but only disturbed demonstrations vary"),
        ({"format": "robomme-hdf5", "pictures": "lossy-video"}, "holds lossless pictures"),
        ({"size": 8}, "size is 8; it must be an even number from 16"),
        ({"cameras": ()}, "cameras is empty; without pictures, ask for"),
        ({"disturbed": True, "policy": "random"}, "only the oracle is disturbed"),
        ({"disturbed": True, "format": "robomme-hdf5"}, "no place for one that was not executed"),
        ({"actions": "waypoint", "video": True}, "actions is 'waypoint': such frames have the"),
        (
            {"cameras": ("front",), "format": "robomme-hdf5"},
            r"cameras is front and size .*; .* both cam",
        ),
    ],
)
def test_plans_that_make_no_sense_are_refused(make_plan, changes, message):
    with pytest.raises(InvalidValueError, match=message):
        make_plan(**changes)


def test_the_card_says_how_many_episodes_of_which_outcome_there_are(export):
    card = (export(pictures="lossy-video") / "README.md").read_text()

    assert "4 success, 2 failure" in card
    assert "with loss: H.264, yuv420p" in card


def test_the_card_of_version_3_has_the_command_that_trains(export):
    """Below `lerobot-train` stand its options: PyAV decodes the export's videos everywhere, and
    nothing is pushed to a hub. A sentence warns that such a policy solved 0 of 50 episodes.
    """
    card = (export(pictures="lossy-video") / "README.md").read_text()

    _, _, training = card.partition("lerobot-train")

    assert "--dataset.video_backend=pyav" in training
    assert "--policy.push_to_hub=false" in training
    assert "solved 0 of 50 episodes" in training


def test_the_card_of_version_2_1_has_a_configuration_that_trains(export):
    """Version 2.1 of the format is for openpi, which is configured in Python. The card's block of
    Python has to compile, and maps the wrist's picture to the name that openpi's policies have for
    it.
    """
    card = (export(format="lerobot-v2.1") / "README.md").read_text()

    config = card.split("```python\n")[1].split("```")[0]

    compile(config, "config", "exec")
    assert '"observation/wrist_image": "wrist_image"' in config


@pytest.mark.parametrize(
    ("forms", "instructions"),
    [(("implicit", "resolved"), 1 + 2 + 2), (("resolved",), 3)],
)
def test_an_explicit_instruction_is_its_own_resolved_form(make_plan, forms, instructions):
    """Of three settings in two forms, direct and spatial have two texts, explicit one: five.

    Each of six trajectories (two tasks of three episodes) has so many.
    """
    plan = make_plan(forms=forms, settings=("explicit", "direct", "spatial"))
    assert [len(said) for _, said in recording_jobs(plan)] == [instructions] * 6


def test_an_export_without_pictures_has_no_columns_of_them(export):
    """Two tasks with two successful episodes each are four trajectories to read."""
    root = export(pictures="none", video=True)

    info = json.loads((root / "meta/info.json").read_text())

    assert not [name for name in info["features"] if "image" in name]
    card = (root / "README.md").read_text()
    assert "There are no pictures." in card
    assert f"license: {OWN_LICENSE}" in card
    assert len(list(read_dataset(root))) == 4


def test_the_card_has_the_license_of_pictures(export):
    """They show models of others."""
    card = (export() / "README.md").read_text()

    assert f"license: {PICTURE_LICENSE}" in card
    assert TERMS in card


def test_the_card_names_the_files_of_frames_to_who_loads_the_dataset(export):
    """`datasets.load_dataset` and the Hub's viewer must not take the table of facts for frames."""
    root = export(pictures="none")

    head = (root / "README.md").read_text().split("---")[1]
    pattern = yaml.safe_load(head)["configs"][0]["data_files"]

    assert {*root.glob(pattern)} == {*(root / "data").rglob("*.parquet")}
