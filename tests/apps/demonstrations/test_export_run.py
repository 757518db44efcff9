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

HERE = Path(__file__).parent


def quiet(*_):
    pass


def contents(root):
    """Return every file but the card, which names the folder."""
    return {
        path.relative_to(root): path.read_bytes()
        for path in root.rglob("*")
        if path.is_file() and path.name != "README.md"
    }


@pytest.mark.slow
def test_a_killed_export_continues_without_a_broken_file(tmp_path, synthetic):
    """Killed again and again, each time a few files later."""
    whole = tmp_path / "whole"
    out = tmp_path / "killed"
    export_run.run_export(killed_export.PLAN, whole, 0, quiet)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join([str(HERE), *sys.path])}

    for last in itertools.count(2, 3):
        command = [sys.executable, HERE / "killed_export.py", out, str(last)]
        done = subprocess.run(command, env=environment, check=False)
        if (out / "meta/info.json").exists():
            assert list(read_dataset(out))
        if done.returncode == 0:
            break
        assert done.returncode == -signal.SIGKILL

    assert last > 10
    assert contents(out) == contents(whole)


def test_each_trajectory_is_recorded_once(tmp_path, synthetic, make_plan, monkeypatch):
    out = tmp_path / "data"
    played = []
    progress = []

    def record(episode, *args, **options):
        is_first_export = not progress
        if is_first_export and len(played) == 3:
            raise KeyboardInterrupt
        played.append((episode.task, episode.index))
        return synthetic_trajectories.record(episode, *args, **options)

    monkeypatch.setattr(export_run, "record_trajectory", record)
    with pytest.raises(KeyboardInterrupt):
        export_run.run_export(make_plan(), out, 0, quiet)
    export_run.run_export(make_plan(), out, 0, lambda *now: progress.append(now))

    assert len(set(played)) == len(played) == 6
    assert progress[0][:3] == ("record", 3, 6)
    assert progress[-1][:3] == ("write", 4, 4)
    sizes = [size for work, _, _, size in progress if work == "record"]
    assert sizes == sorted(set(sizes))  # of all trajectories up to then
    assert not (out / export_run.WORK_FOLDER).exists()


def test_kept_trajectories_serve_other_formats(tmp_path, synthetic, make_plan, monkeypatch):
    kept = tmp_path / "kept"
    export_run.run_export(make_plan(), tmp_path / "v3", 0, quiet, kept)
    monkeypatch.setattr(export_run, "record_trajectory", None)
    plan = make_plan(format="lerobot-v2.1", settings=("reasoning",))

    summary = export_run.run_export(plan, tmp_path / "v21", 0, quiet, kept)

    assert summary.recorded == 0
    assert summary.episodes == 4


def test_kept_trajectories_of_other_outcomes_words_or_worlds_are_not_taken(
    tmp_path, synthetic, make_plan, monkeypatch
):
    kept = tmp_path / "kept"
    spoken = {"policy": "listener", "episodes": (0,)}
    for number, (version, changes, recorded) in enumerate(
        (
            (ENVIRONMENT_VERSION, {}, 6),
            (ENVIRONMENT_VERSION, {"outcomes": "all"}, 2),  # of failures no pictures were kept
            (ENVIRONMENT_VERSION, spoken, 4),
            (ENVIRONMENT_VERSION, {**spoken, "forms": ("implicit", "resolved")}, 2),
            (ENVIRONMENT_VERSION + 1, {}, 6),
        )
    ):
        monkeypatch.setattr(export_run, "ENVIRONMENT_VERSION", version)
        summary = export_run.run_export(
            make_plan(**changes), tmp_path / str(number), 0, quiet, kept
        )
        assert summary.recorded == recorded


def test_a_trajectory_s_name_has_all_that_it_depends_on(make_plan):
    """A field that the name lacked would give the trajectory of another plan."""
    ((job, _), *_) = recording_jobs(make_plan(policy="listener"))
    fields = {
        "task": "StopCube", "split": "val", "number": 1, "variation": 1, "policy": "forgetful",
    }  # fmt: skip
    spec = {
        "coding": "lossless-video", "video": True, "depth": True, "cameras": ("wrist",),
        "size": 64, "actions": "waypoint", "disturbed": True,
    }  # fmt: skip
    assert set(spec) == set(job.spec._fields)

    others = [replace(job, **{name: value}) for name, value in fields.items()]
    for name, value in spec.items():
        others.append(replace(job, spec=job.spec._replace(**{name: value})))
    options = (
        {"setting": "direct"}, {"form": "resolved"}, {"stages": (1, 5)}, {"frame": "camera"},
        {"distractor": "competing"}, {"distractors": 3}, {"wordings": "train"},
        {"delivery": "turns"},
    )  # fmt: skip
    assert {name for words in options for name in words} == set(OPTION_NAMES)
    for words in options:
        others.append(replace(job, options=replace(job.options, **words)))

    assert len({exported.path(Path()) for exported in (job, *others)}) == 1 + len(others)


def test_a_stopped_export_of_another_version_is_another_one(make_plan, monkeypatch):
    found = {make_plan().fingerprint()}
    for name, other in (
        ("language_label", lambda *_: "another"),  # which names the words of each task
        ("ENVIRONMENT_VERSION", "another"),
        ("TRAJECTORY_VERSION", "another"),
    ):
        monkeypatch.setattr(export_plan, name, other)
        found.add(make_plan().fingerprint())
    assert len(found) == 4


def test_failures_are_exported_only_on_request(export):
    successes = list(read_dataset(export("successes")))
    root = export("all", outcomes="all")
    everything = list(read_dataset(root))
    assert {recorded.status for recorded in successes} == {"success"}
    assert [recorded.status for recorded in everything].count("failure") == 2
    assert len(everything) == len(successes) + 2

    stats = json.loads((root / "meta/stats.json").read_text())["next.success"]
    assert stats["mean"] == pytest.approx([4 / (6 * synthetic_trajectories.STEPS)])


def test_variations_are_trajectories_of_their_own(export):
    found = list(read_dataset(export(tasks=("PickXtimes",), variations=3, disturbed=True)))
    assert [(recorded.name, len(recorded.actions)) for recorded in found] == [
        (f"PickXtimes/train/{episode}/{variation}", synthetic_trajectories.STEPS + variation)
        for episode in (0, 2)
        for variation in range(3)
    ]


def test_a_policy_is_recorded_in_every_setting(export):
    root = export(tasks=("PickXtimes",), policy="listener", episodes=(0,))
    assert [recorded.name for recorded in read_dataset(root)] == [
        "PickXtimes/train/0/0/explicit-implicit",
        "PickXtimes/train/0/0/direct-implicit",
    ]

    table = parquet.read_table(root / "meta/demonstrations.parquet")
    assert set(table["policy"].to_pylist()) == {"listener"}


def test_the_action_of_a_disturbed_frame_is_what_should_have_been_done(export):
    root = export(tasks=("PickXtimes",), episodes=(0,), settings=("explicit",), disturbed=True)
    (executed,) = read_dataset(root)
    table = parquet.read_table(root / "data/chunk-000/file-000.parquet")
    labels = np.array(table["action"].to_pylist())

    assert np.allclose(labels, executed.actions + 1.0)
    assert np.array_equal(table["executed_action"].to_pylist(), executed.actions)
    assert "**disturbed**" in (root / "README.md").read_text()

    (row,) = parquet.read_table(root / "meta/demonstrations.parquet").to_pylist()
    assert (row["disturbed"], row["actions"]) == (True, "joint_angle")


def test_other_options_and_folders_are_refused(tmp_path, export, make_plan, monkeypatch):
    root = export()
    with pytest.raises(InvalidValueError, match="complete export already"):
        export_run.run_export(make_plan(), root, 0, quiet)
    strange = tmp_path / "strange"
    strange.mkdir()
    (strange / "thesis.tex").touch()
    with pytest.raises(InvalidValueError, match="is not empty and no export"):
        export_run.run_export(make_plan(), strange, 0, quiet)
    assert [path.name for path in strange.iterdir()] == ["thesis.tex"]

    monkeypatch.setattr(export_run, "record_trajectory", None)
    with pytest.raises(TypeError):
        export_run.run_export(make_plan(), tmp_path / "stopped", 0, quiet)
    with pytest.raises(InvalidValueError, match="started with other options"):
        export_run.run_export(make_plan(settings=("direct",)), tmp_path / "stopped", 0, quiet)


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
        *(
            ({"actions": "waypoint", **other}, "actions is 'waypoint': such frames have the")
            for other in ({"format": "lerobot-v2.1"}, {"video": True})
        ),
        *(
            ({"cameras": ("front",), **other}, r"cameras is front and size .*; .* both cam")
            for other in ({"format": "robomme-hdf5"}, {"format": "lerobot-v2.1"})
        ),
    ],
)
def test_plans_that_make_no_sense_are_refused(make_plan, changes, message):
    with pytest.raises(InvalidValueError, match=message):
        make_plan(**changes)


def test_the_card_tells_outcomes_and_lines_to_train(export):
    card = (export(pictures="lossy-video") / "README.md").read_text()
    assert "4 success, 2 failure" in card
    assert "with loss: H.264, yuv420p" in card
    assert "solved 0 of 50 episodes" in card.partition("lerobot-train")[2]
    assert "--dataset.video_backend=pyav" in card
    assert "--policy.pretrained_backbone_weights=null" in card
    assert "--policy.push_to_hub=false" in card

    text = (export("v21", format="lerobot-v2.1") / "README.md").read_text()
    config = text.split("```python\n")[1].split("```")[0]
    compile(config, "config", "exec")
    assert '"observation/wrist_image": "wrist_image"' in config


def test_an_explicit_instruction_is_its_own_resolved_form(make_plan):
    both = make_plan(forms=("implicit", "resolved"), settings=("explicit", "direct", "spatial"))
    assert [len(said) for _, said in recording_jobs(both)] == [1 + 2 + 2] * 6

    alone = make_plan(forms=("resolved",), settings=("explicit", "direct"))
    assert [len(said) for _, said in recording_jobs(alone)] == [2] * 6


def test_states_alone_need_no_pictures(export):
    root = export(pictures="none", video=True)
    card = (root / "README.md").read_text()
    assert "There are no pictures." in card

    # What `datasets.load_dataset` and the Hub's viewer read: frames, and no table of facts.
    pattern = yaml.safe_load(card.split("---")[1])["configs"][0]["data_files"]
    assert {*root.glob(pattern)} == {*(root / "data").rglob("*.parquet")}
    assert [recorded.task for recorded in read_dataset(root)] == ["PickXtimes"] * 2 + [
        "VideoUnmask"
    ] * 2

    info = json.loads((root / "meta/info.json").read_text())
    assert not [name for name in info["features"] if "image" in name]
