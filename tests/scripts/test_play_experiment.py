"""The paper's experiment on the small body: what is stored, what it depends on, and its proof."""

import re
import shutil
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from experiment.store import Entry, Store
from msgspec.structs import replace
from selection import slow_but

from roboirg.core.environment_options import EnvironmentOptions
from roboirg.core.errors import RoboIRGError
from roboirg.core.instruction_options import InstructionOptions
from roboirg.records.record_codec import StoreError

SCRIPTS = Path(__file__).parents[2] / "scripts"
KEY = {"body": "a1b2", "code": "new"}
ADDING = """
import sys
from pathlib import Path
from experiment import store

store.PACKED_BYTES = 300
with store.Store(Path(sys.argv[1])) as added:
    for number in range(len(added), 100_000):
        added.add(store.Entry({"number": str(number), "code": "new"}, f"{number} steps"))
        print(number, flush=True)
"""
"""Adds entries until it is killed, and prints each that is stored; packs have some ten entries."""


def numbers_printed_before_a_kill(folder, seconds):
    """Run the program that adds entries; kill it so many seconds after it has printed the first."""
    words = (sys.executable, "-c", ADDING, str(folder))
    with subprocess.Popen(words, stdout=subprocess.PIPE, text=True, cwd=SCRIPTS) as process:
        printed = [process.stdout.readline()]
        time.sleep(seconds)
        process.kill()
        printed += process.stdout
    return list(map(int, printed))


@pytest.mark.parametrize("seed", slow_but([0, 1], range(12)))
def test_a_kill_at_any_moment_loses_no_entry_that_was_stored(seed, tmp_path):
    """A program stores entries number 0, 1, 2, …, and prints the number of each that is stored.

    It is killed at a random moment within 0.1 s after the first one, three times. As numbers begin
    with 0, one more than the last printed number are stored, or two more if it was killed between
    storing and printing. The next program goes on with the number after these.
    """
    rng = np.random.default_rng(seed)

    stored = 0
    for _ in range(3):
        printed = numbers_printed_before_a_kill(tmp_path, seconds=rng.uniform(0, 0.1))
        assert printed[0] == stored
        with Store(tmp_path) as store:
            stored = len(store)
        assert stored in (printed[-1] + 1, printed[-1] + 2)


def add(folder, verdict, **key):
    """Store an entry, under KEY with some of its values changed."""
    with Store(folder) as store:
        store.add(Entry({**KEY, **key}, verdict))


def test_an_unfinished_line_is_moved_aside(tmp_path):
    """One entry is stored whole, the line of a second one is cut off, as by a kill, and a third one
    is added afterwards: two can be read."""
    add(tmp_path, "success 20")
    (tmp_path / "open.jsonl").write_bytes(b'{"key":{"body":"c3')

    add(tmp_path, "failure 30", body="c3d4")

    with Store(tmp_path) as store:
        assert len(store) == 2
        assert store.get(KEY).verdict == "success 20"


def join(first, second):
    """Copy the packs of the second store to the first."""
    for path in second.glob("*.xz"):
        shutil.copy(path, first / path.name)


def test_stores_are_joined_by_copying_their_packs(tmp_path):
    """A store is a folder with compressed files, its packs, which other machines fill, too.

    Two have one entry in common, and each has one more: three after those of one were copied to the
    other.
    """
    first = tmp_path / "first"
    second = tmp_path / "second"
    for folder in (first, second):
        add(folder, "success 20")
        add(folder, "failure 30", body=folder.name)

    join(first, second)

    with Store(first) as store:
        assert len(store) == 3
        assert store.get({**KEY, "body": "second"}).verdict == "failure 30"


def test_entries_that_contradict_each_other_are_refused_with_both_files(tmp_path):
    """The same play is a success in one store and a failure in the other. Their packs are joined in
    one folder, and the error names both files."""
    add(tmp_path, "success 20")
    add(tmp_path / "second", "failure 30")
    join(tmp_path, tmp_path / "second")
    files = sorted(map(str, tmp_path.glob("*.xz")))

    with pytest.raises(StoreError, match=".*".join(map(re.escape, files))):
        Store(tmp_path)


def test_a_damaged_pack_is_refused(tmp_path):
    """A store with one entry is one compressed file, a pack. Its last nine bytes are cut off, so
    that it cannot be unpacked."""
    add(tmp_path, "success 20")
    (pack,) = tmp_path.glob("*.xz")
    pack.write_bytes(pack.read_bytes()[:-9])

    with pytest.raises(StoreError, match=f"{pack.name} is damaged"):
        Store(tmp_path)


def test_entries_of_earlier_code_count_only_if_it_is_named(tmp_path):
    """An entry was made by code "old". A store for the code of today does not find it, unless "old"
    is among the versions that it is told to accept."""
    add(tmp_path, "success 20", code="old")

    with Store(tmp_path) as store:
        assert store.get(KEY) is None
    with Store(tmp_path, ["older", "old"]) as store:
        assert store.get(KEY).verdict == "success 20"


@pytest.fixture
def study(tmp_path):
    """A study of one row, which plays an episode of PickXtimes in explicit words."""
    pytest.importorskip("torch")
    from experiment.study import Study

    return Study(
        name="small", memories="recurrent", seeds="0", readers="all", tasks="PickXtimes",
        settings="explicit", split="val", episodes="1", max_steps=90,
        results=tmp_path / "results", work=tmp_path / "work", workers=0,
    )  # fmt: skip


def test_results_of_a_study_go_into_the_page_next_to_their_folder(study):
    """The only trial succeeds. Facts and what needs no play are there, too: in explicit words a
    guess is always right, and somebody has noted two looks at the split."""
    import pandas as pd
    from experiment.results import write_results

    save_random_policy(study, "recurrent")
    trial = {
        "policy": "recurrent-all", "policy_seed": 0, "setting": "explicit",
        "instruction_options": "explicit", "task": "PickXtimes", "suite": "counting",
        "split": "val", "episode": 0, "outcome": "success", "failure_kind": None,
    }  # fmt: skip
    pd.DataFrame([trial]).to_csv(study.results / "small.csv.xz", index=False)
    (study.results / "looks.csv").write_text("split,why\nval,an epoch\nval,a table\n")
    page = study.results.parent / "README.md"
    parts = [f"<!-- {name} -->\n\n\n\n<!-- end of {name} -->" for name in ("results", "facts")]
    page.write_text("\n\n".join(parts))

    write_results(study)

    written = page.read_text()
    assert "| recurrent | all | 100 |" in written
    assert "| *guess* | – | 100 |" in written
    assert "| looks at `val` | 2 |" in written
    assert re.search(r"\| parameters of `recurrent` \| detector [\d,]+, body [\d,]+ \|", written)
    assert re.search(r"\| unknown to the reader of `all`, % \| explicit \d+ \|", written)


@pytest.fixture
def play_key(study, monkeypatch):
    """Return the key of a play after some changes of what it depends on."""
    from experiment import study as module
    from experiment.study import Trial

    from roboirg_learn.policy.trained_reader import HeardGoal

    circumstances = {"code": "a", "environment": "1", "torch": "2", "processor": "x86"}
    monkeypatch.setattr(module, "circumstances", lambda: circumstances)
    (usual,) = study.trials()

    def make(name="a", weights=b"1", heard=("PickXtimes", "red"), circumstance="", **job):
        row = usual.row._replace(memory=name, weights=study.work)
        row.body.parent.mkdir(exist_ok=True)
        row.body.write_bytes(weights)
        changed = replace(usual.job, episode=2)  # its scene has another goal, too
        if circumstance:
            monkeypatch.setitem(circumstances, circumstance, "other")
        return Trial(row, replace(changed, **job)).play_key(HeardGoal(*heard))

    return make


@pytest.mark.parametrize(
    "changes",
    [
        {"weights": b"2", "name": "b"},
        {"episode": 3},
        {"arm": "other-goal"},
        {"heard": ("BinFill", "red")},
        {"heard": ("PickXtimes", "blue")},
        {"environment": EnvironmentOptions(max_steps=900)},
        {"circumstance": "code"},
        {"circumstance": "environment"},
        {"circumstance": "torch"},
        {"circumstance": "processor"},
    ],
)
def test_the_key_of_a_play_changes_with_all_that_decides_it(changes, play_key):
    """`play_key` gives the key of a usual play, or of one with some changes: other weights or
    another memory, episode, arm, heard goal, options of the environment, code or machine. Else a
    play would stand for another one."""
    assert play_key() != play_key(**changes)


def test_the_key_of_a_play_does_not_change_with_words_or_the_name_of_a_file(play_key):
    """A policy acts on the goal that it has heard, so other words for the same goal, "direct" in
    the form "resolved", and another name of the file of its weights change nothing."""
    assert play_key() == play_key("b", options=InstructionOptions("direct", "resolved"))


@pytest.mark.parametrize("namer", ["surface", "first-mention", "last-mention", "elimination"])
def test_a_reader_behind_a_rewriter_hears_what_it_hears_in_a_run(namer, study):
    """A run puts a namer in front of a policy by the name of both, here that of the study's row.
    The policy hears the same words, and the same goal is reported, also where the rule draws one.

    A rule names no goal in spatial words, which are passed on as they were said.
    """
    from roboirg.policies.by_name.finding import rewriting_in
    from roboirg.policies.by_name.policy_kinds import put_behind, split_spec
    from roboirg.runs.job_instruction import PreparedJob, episode_policy_seed

    study.readers = [f"resolve-{namer}"]
    study.settings = "direct,spatial"
    study.seeds = [0, 1, 2]
    for trial in study.trials():
        prepared = PreparedJob(trial.job)
        said = prepared.words.instruction
        heard = []
        policy = SimpleNamespace(reset=lambda words, _shown, heard=heard: heard.append(words))
        rewriting = rewriting_in(split_spec("a", trial.row.spec))
        seed = episode_policy_seed(trial.row.seed, prepared.episode.seed)
        in_run = put_behind(rewriting, policy, seed)
        in_run.attach(SimpleNamespace(episode=prepared.episode, instruction=said, unheard=0))
        in_run.reset(" ".join(said.turns), {})

        assert heard == [trial.reported["heard"]]
        assert in_run.metadata.get("understood") == trial.reported.get("understood")
        is_passed_on = heard == [" ".join(said.turns)]
        assert is_passed_on == (trial.job.setting == "spatial")


def test_a_row_behind_a_rewriter_names_the_policy_alone(study):
    """A run that plays the row has the spec of the row with the reader of explicit words in it, and
    the table of rewriters finds that row by what the records of the other one name."""
    from roboirg.core.versions import makeup_text
    from roboirg.policies.by_name.finding import rewriting_in
    from roboirg.policies.by_name.policy_kinds import split_spec

    study.readers = ["resolve-surface", "explicit"]
    behind, alone = study.rows()

    rewriting = rewriting_in(split_spec("a", behind.spec))

    assert rewriting == ("surface", {}, alone.spec, "train")
    assert dict(behind.ref.makeup)["behind"] == makeup_text(alone.ref.makeup)


@pytest.mark.sim
@pytest.mark.slow
@pytest.mark.parametrize(
    ("memory", "reader"),
    [("recurrent", "all"), ("subgoal", "all"), ("recurrent", "resolve-surface")],
)
def test_a_goal_that_is_heard_and_then_played_gives_what_a_run_with_words_records(
    memory, reader, study, capsys
):
    """The experiment does in two steps what a run does in one: it finds which goal a policy hears
    in the words of an episode, and it plays the policy for that goal. Many words share a play.

    `study` is an experiment with one episode and one policy, here with random weights. The proof
    plays the episode in the ordinary way, with its words, and must find the same record. This would
    find motion that depends on words in another way than through the goal. The table of results
    has the outcome and the steps of the play. The pack has its record, with the actions that the
    proof has left, and all of it holds.
    """
    import pandas as pd
    from experiment.frame import found_plays, prove, write_frame
    from experiment.hearing import hear_missing
    from experiment.packs import write_pack
    from experiment.playing import play_missing

    from roboirg.apps.leaderboard.run_verification import verify_run
    from roboirg.records.packs import opened_run

    study.memories = [memory]
    study.readers = [reader]
    study.settings = "direct"
    save_random_policy(study, memory)

    hear_missing(study)
    play_missing(study)
    prove(study)
    write_frame(study)
    write_pack(study)

    assert "proof: 1 trials were played in the ordinary way, 0 differ" in capsys.readouterr().out
    ((_trial, play),) = found_plays(study)
    (line,) = pd.read_csv(study.results / "small.csv.xz").to_dict("records")
    assert f"{line['outcome']} {line['steps']} " in play.verdict
    with opened_run(study.results / "small.roboirg.zip") as folder:
        verified = verify_run(folder)
    assert verified.holds
    assert verified.verdicts == {"exact": 1}


@pytest.mark.sim
@pytest.mark.slow
def test_what_was_done_in_a_scene_before_is_not_simulated_again(study, monkeypatch):
    """A policy with random weights plays an episode. The same policy then gets the same record
    without the simulator, and a simulation gives that record, too, but for its times."""
    from experiment import playing

    study.readers = ["truth"]
    save_random_policy(study, "recurrent")
    (wanted,) = playing.wanted_plays(study)
    job = replace(wanted.trial.job, policy="body", policy_seed=0, options=playing.UNHEARD)

    first = playing.play_wanted([wanted], job)
    playing.known_scene.cache_clear()
    simulated = playing.play_wanted([wanted], job)
    monkeypatch.delattr(playing, "play_with")
    again = playing.play_wanted([wanted], job)

    assert again == simulated
    timeless = {"started_at": "", "duration_s": 0.0}
    assert replace(first, **timeless) == replace(simulated, **timeless)


def test_a_policy_gets_the_record_of_an_earlier_one_that_did_the_same_and_no_other():
    """Each policy answers some numbers, one after the other, and may name a subgoal with them. Two
    have played in the scene; what others begin like them, but do not end so, has no record yet."""
    pytest.importorskip("torch")
    from experiment.rehearsing import KnownScene

    scene = KnownScene()
    scene.keep(asked([1, 2]), "first")
    scene.keep(asked([1, 3, 4]), "second")

    assert scene.rehearse(answering([1, 2])) == "first"
    assert scene.rehearse(answering([1, 3, 4])) == "second"
    for answers in ([2], [1, 4], [1, 3, 5]):
        assert scene.rehearse(answering(answers)) is None
    assert scene.rehearse(answering([1, 2], subgoal="press the button")) is None


def test_a_world_that_answers_the_same_actions_differently_is_refused():
    """No play could stand for another one there."""
    pytest.importorskip("torch")
    from experiment.rehearsing import KnownScene

    scene = KnownScene()
    scene.keep(asked([1, 2]), SimpleNamespace(slug="a"))

    with pytest.raises(RoboIRGError, match="the world is not the same as before"):
        scene.keep(asked([1, 3], first_seen=7), SimpleNamespace(slug="b"))


def asked(answers, first_seen=0):
    """Return a watched policy that has given some answers, each to the next number as observed."""
    from experiment.rehearsing import SEEN, WatchedPolicy

    policy = WatchedPolicy(answering(answers))
    policy.reset("", {})
    for number in range(first_seen, first_seen + len(answers)):
        policy.act(dict.fromkeys(SEEN, number))
    return policy


def answering(answers, subgoal=None):
    """Return a policy that answers some numbers, one after the other."""
    left = iter(answers)
    return SimpleNamespace(
        reset=lambda *_heard: None, act=lambda _seen: np.array([next(left)]), subgoal=subgoal
    )


def save_random_policy(study, memory):
    """Save the policy of the only row of a study, with random weights and a kind of memory."""
    from untrained import save_policy

    from roboirg_learn.policy.policy_files import PolicyFiles
    from roboirg_learn.policy.sight import ObjectClasses

    (row,) = study.rows()
    row.body.parent.mkdir(parents=True)
    objects = ObjectClasses(("button", "cube red", "target"), np.array([0.01, 0.02, 0.005]))
    save_policy(PolicyFiles(row.body, row.reader), memory, objects)
