"""Malformed runs, packs, plans and wording files: one sentence or an answer, and nothing outside.

Each attack changes an honest run, then reads it. Without a simulator; what replays say about forged
actions is in test_verification.py.
"""

from __future__ import annotations

import hashlib
import io
import itertools
import json
import os
import re
import shutil
import struct
import zipfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from evaluation_fakes import fake_record, small_plan

from roboirg.apps.leaderboard.packing import pack_run
from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.core.errors import RoboIRGError
from roboirg.evaluation.analysis.page.report import write_report
from roboirg.evaluation.analysis.results.reading import read_frame
from roboirg.evaluation.plan.plan_file import read_plan_file
from roboirg.evaluation.plan.sources import Source
from roboirg.evaluation.plan.stored_plans import read_plans, write_plan
from roboirg.evaluation.records.action_log import ActionLog, read_actions, write_actions
from roboirg.evaluation.records.episode_log import log_path
from roboirg.evaluation.records.merging import merge_runs
from roboirg.evaluation.records.packs import MANIFEST, opened_run
from roboirg.evaluation.records.run_files import PLAN_FILE
from roboirg.evaluation.records.store import (
    RECORDS_FILE,
    RecordStore,
    read_records,
)
from roboirg.language.scenarios.wording_file import read_wordings

CANARY = "canary of another folder"
LONGEST_MESSAGE = 1_500

Change = Callable[[Path], object]
Reader = Callable[[Path], object]


@pytest.fixture(scope="module")
def honest(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("honest") / "run"
    plan = small_plan(episodes=1)
    with RecordStore(folder) as store:
        for job in plan.jobs():
            log = ActionLog("joint_angle", np.ones((3, 8)), np.zeros(1, np.int32), np.ones(2))
            video = f"videos/{job.slug}.mp4"
            digest = write_actions(log, folder)
            record = fake_record(
                job,
                started_at="2026-11-23T12:00:00+00:00",
                video=video,
                plan=plan.fingerprint,
                action_log=digest,
            )
            store.append(record)
            for name, content in ((video, b"film"), (log_path(Path(), job.slug), b"printed")):
                (folder / name).parent.mkdir(exist_ok=True)
                (folder / name).write_bytes(content)
            (folder / video).with_suffix(".jpg").write_bytes(b"poster")
    write_plan(plan, folder)
    return folder


@pytest.fixture
def run(honest: Path, tmp_path: Path) -> Path:
    (tmp_path / "secret.txt").write_text(CANARY)
    return Path(shutil.copytree(honest, tmp_path / "run"))


def pack(run: Path) -> Path:
    out = run.parent / "mine.roboirg.zip"
    pack_run(run, out, videos=True, logs=True)
    return out


def merge(run: Path) -> Path:
    merge_runs([run], run.parent / "merged")
    return run.parent / "merged"


def read_frame_of(run: Path) -> object:
    return read_frame([Source(run)], words=True)


def report(run: Path) -> Path:
    pytest.importorskip("jinja2")
    return write_report(Source(run))


def verify(run: Path) -> str:
    return "\n".join(
        finding for check in verify_run(run, sample=0).checks for finding in check.findings
    )


def refusal(reader: Reader, path: Path) -> str:
    """Return the one sentence in which something is refused."""
    with pytest.raises(RoboIRGError) as caught:
        reader(path)
    return fit(str(caught.value))


def fit(message: str) -> str:
    assert len(message) < LONGEST_MESSAGE
    assert "matching regex" not in message
    return message


def line_of(run: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((run / RECORDS_FILE).read_text().splitlines()[0])
    return found


def option(**changes: object) -> Change:
    return lambda run: record(options={**line_of(run)["options"], **changes})(run)


def record(**changes: object) -> Change:
    def change(run: Path) -> None:
        lines = (run / RECORDS_FILE).read_text().splitlines()
        lines[0] = json.dumps({**json.loads(lines[0]), **changes})
        (run / RECORDS_FILE).write_text("\n".join(lines) + "\n")

    return change


def raw(old: bytes, new: bytes) -> Change:
    def change(run: Path) -> None:
        content = (run / RECORDS_FILE).read_bytes()
        assert old in content
        (run / RECORDS_FILE).write_bytes(content.replace(old, new, 1))

    return change


def replaced(name: str, make: Callable[[Path], object]) -> Change:
    """Put something else in the place of a file or folder."""

    def change(run: Path) -> None:
        path = run / name
        path.parent.mkdir(exist_ok=True)
        if path.is_dir():
            shutil.rmtree(path)
        path.unlink(missing_ok=True)
        make(path)

    return change


def link(target: str) -> Callable[[Path], None]:
    return lambda path: path.symlink_to(target)


def sparse(size: int) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        path.touch()
        os.truncate(path, size)

    return make


def planned(**changes: object) -> Change:
    def change(run: Path) -> None:
        plan = json.loads((run / PLAN_FILE).read_text())
        (run / PLAN_FILE).write_text(json.dumps({**plan, **changes}))

    return change


REFUSED_RECORDS: Mapping[str, tuple[Change, str]] = {
    "step limit of 10**30": (
        record(environment={"max_steps": 10**30}),
        r"\$\.environment\.max_steps",
    ),
    "seed of 10**40": (record(seed=10**40), r"\$\.seed"),
    "step 10**25": (record(steps=10**25), r"\$\.steps"),
    "a million stages": (option(stages=[1] * 1_000_000), "length <= 100"),
    "cause of 5 MB": (record(outcome="failure", cause="x" * 5_000_000), r"\$\.cause"),
    "version in bidi marks": (record(language_version="\u202e0.0.2"), "control characters"),
    "policy with a line end": (record(policy="random\n"), "control characters"),
    "policy that is a formula": (record(policy="=cmd|' /C calc'!A0"), "none of = [+] - @"),
    "task that is a formula": (record(task="@SUM(1)"), "none of = [+] - @"),
    "setting that is a formula": (option(setting="+1+1"), "none of = [+] - @"),
    "video with a line end": (record(video="videos/a.mp4\n"), "path below"),
    "video outside": (record(video="videos/../../secret.mp4"), "path below"),
    "line of 65 MiB": (
        lambda run: os.truncate(run / RECORDS_FILE, 65 << 20),
        "line 3 has more than",
    ),
    "pipe": (replaced(RECORDS_FILE, os.mkfifo), "not a regular file"),
    "circle of links": (replaced(RECORDS_FILE, link(RECORDS_FILE)), "symbolic links"),
}


REFUSED_COURSES: Mapping[str, tuple[Change, str]] = {
    "event at step 10**25": (
        record(events=[{"step": 10**25, "kind": "home", "subject": "robot"}]),
        r"\$\.events\[0\]\.step",
    ),
    "field of a mention that no version has": (
        record(mentions=[{"luck": 1}]),
        "unknown field `luck`",
    ),
    "field that no version has": (record(mentions=[], luck=1), "unknown field `luck`"),
}
"""What packs hold unread."""


@pytest.mark.parametrize(
    ("name", "reader"),
    [
        *itertools.product(REFUSED_RECORDS, (read_records, pack)),
        *itertools.product(REFUSED_COURSES, (read_records, merge)),
    ],
)
def test_records_are_refused(name: str, reader: Reader, run: Path) -> None:
    change, says = {**REFUSED_RECORDS, **REFUSED_COURSES}[name]
    change(run)
    message = refusal(reader, run)
    assert re.search(says, message)
    assert RECORDS_FILE in message


DAMAGED_LINES: Mapping[str, Change] = {
    "bytes that are no UTF-8": raw(b'"policy":"random"', b'"policy":"\xff\xfe"'),
    "overlong UTF-8": raw(b'"video":"videos/', b'"video":"videos/\xc0\xae\xc0\xae/'),
    "lone surrogate": raw(b'"policy":"random"', b'"policy":"\\udfff"'),
    "deep nesting": raw(b'"policy_metadata":{', b'"policy_metadata":{"a":' + b"[" * 200_000),
}


@pytest.mark.parametrize("name", DAMAGED_LINES)
def test_damaged_lines_are_skipped_with_a_warning(
    name: str, run: Path, caplog: pytest.LogCaptureFixture
) -> None:
    DAMAGED_LINES[name](run)
    assert len(read_records(run)) == 1
    assert f"{run / RECORDS_FILE} has 1 damaged line, the first is line 1" in caplog.text


@pytest.mark.parametrize("reader", [read_frame_of, merge, report])
def test_what_reads_a_damaged_run_says_so(
    reader: Reader, run: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with (run / RECORDS_FILE).open("ab") as file:
        file.write(b'{"policy": "rand\n{"torn')
    reader(run)
    (warning,) = caplog.messages
    assert "records.jsonl has 1 damaged line, the first is line 3" in warning


@pytest.mark.parametrize("reader", [pack, verify])
def test_a_damaged_run_is_neither_packed_nor_verified(reader: Reader, run: Path) -> None:
    raw(b'"policy":"random"', b'"policy":"\xff"')(run)
    assert "has 1 damaged line, the first is line 1" in refusal(reader, run)
    merged = merge(run)
    assert len(read_records(merged)) == 1
    reader(merged)


def test_a_mark_of_byte_order_before_the_only_line_is_named(run: Path) -> None:
    line = (run / RECORDS_FILE).read_bytes().splitlines(keepends=True)[0]
    (run / RECORDS_FILE).write_bytes(b"\xef\xbb\xbf" + line)
    assert "has 1 damaged line, the first is line 1" in refusal(read_records, run)


def test_a_warning_about_a_pack_names_the_pack(run: Path, caplog: pytest.LogCaptureFixture) -> None:
    packed = pack(run)
    with zipfile.ZipFile(packed) as archive:
        held = {name: archive.read(name) for name in archive.namelist()}
    held[RECORDS_FILE] += b"damaged\n"
    manifest = json.loads(held[MANIFEST])
    manifest["files"][RECORDS_FILE] = hashlib.sha256(held[RECORDS_FILE]).hexdigest()
    held[MANIFEST] = json.dumps(manifest).encode()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in held.items():
            archive.writestr(name, content)
    with opened_run(packed) as folder:
        assert len(read_records(folder)) == 2
    assert f"{packed.name}/{RECORDS_FILE} has 1 damaged line" in caplog.text


def _slug(run: Path) -> str:
    return Path(line_of(run)["video"]).stem


def _action_name(run: Path) -> str:
    digest = line_of(run)["action_log"]
    return f"actions/{digest[:2]}/{digest}.npz"


def _linked(name: Callable[[Path], str], target: str) -> Change:
    return lambda run: replaced(name(run), link(target))(run)


def _moved_out(name: str) -> Change:
    def change(run: Path) -> None:
        shutil.move(run / name, run.parent / "outside")
        (run / name).symlink_to("../outside")

    return change


LEADING_OUT: Mapping[str, Change] = {
    "log": _linked(lambda run: f"logs/{_slug(run)}.txt", "../../secret.txt"),
    "video": _linked(lambda run: f"videos/{_slug(run)}.mp4", "../../secret.txt"),
    "poster": _linked(lambda run: f"videos/{_slug(run)}.jpg", "../../secret.txt"),
    "actions": _linked(_action_name, "../../../secret.txt"),
    "plan": replaced(PLAN_FILE, link("../secret.txt")),
    "earlier plan": replaced("plans/1.json", link("../../secret.txt")),
    "folder of logs": _moved_out("logs"),
    "folder of actions": _moved_out("actions"),
    "folder of videos": _moved_out("videos"),
}


@pytest.mark.parametrize("reader", [pack, merge], ids=lambda one: one.__name__)
@pytest.mark.parametrize("name", LEADING_OUT)
def test_links_that_lead_out_are_not_followed(name: str, reader: Reader, run: Path) -> None:
    LEADING_OUT[name](run)
    assert "link leads elsewhere" in refusal(reader, run)
    written = [path for path in run.parent.rglob("*") if path.is_file() and not path.is_symlink()]
    copies = [path for path in written if CANARY.encode() in path.read_bytes()]
    assert copies == [run.parent / "secret.txt"]


@pytest.mark.parametrize(
    "change",
    [
        *(LEADING_OUT[name] for name in ("video", "poster", "folder of videos")),
        lambda run: replaced(f"videos/{_slug(run)}.mp4", link(f"{_slug(run)}.mp4"))(run),  # circle
    ],
)
def test_the_page_embeds_nothing_from_outside(change: Change, run: Path) -> None:
    change(run)
    assert "link leads elsewhere" in refusal(report, run)


def test_a_huge_poster_is_not_embedded(run: Path) -> None:
    replaced(f"videos/{_slug(run)}.jpg", sparse(10 << 30))(run)
    assert report(run).stat().st_size < 20 << 20


def test_a_run_too_large_for_a_pack_is_refused_before_it_is_read(run: Path) -> None:
    replaced("logs/large.txt", sparse(1 << 40))(run)
    assert "logs/large.txt" in refusal(pack, run)
    assert not list(run.parent.glob("*.part"))


def test_hidden_files_and_pipes_are_not_packed(run: Path) -> None:
    (run / "logs" / ".DS_Store").touch()
    os.mkfifo(run / "logs" / "pipe.txt")
    with opened_run(pack(run)) as folder:
        names = {path.name for path in folder.rglob("*")}
    assert not names & {".DS_Store", "pipe.txt"}
    assert f"{_slug(run)}.txt" in names


UNREAD_PLANS: Mapping[str, Change] = {
    "1,200,000 jobs": planned(policy_seeds=list(range(12_000)), episodes=list(range(50))),
    "no seeds": planned(policy_seeds=[]),
    "policy that controls the terminal": planned(policies=["\x1b[31m"]),
    "task that controls the terminal": planned(tasks=["\u202eksat"]),
    "split of half a character": planned(split="\ud800"),
    "deep nesting": replaced(PLAN_FILE, lambda path: path.write_text("[" * 200_000)),
    "pipe": replaced(PLAN_FILE, os.mkfifo),
    "3 GB": replaced(PLAN_FILE, sparse(3 << 30)),
}


def test_a_plan_of_many_jobs_is_read(run: Path) -> None:
    planned(policy_seeds=list(range(9_000)), episodes=list(range(50)))(run)
    assert len(read_plans(run)) == 1


@pytest.mark.parametrize("name", UNREAD_PLANS)
def test_plans_that_cannot_be_are_missing(name: str, run: Path) -> None:
    UNREAD_PLANS[name](run)
    assert read_plans(run) == ()
    assert verify_run(run, sample=0).notes == ("From no plan that is kept: 2 records.",)


def test_a_plan_of_3_gb_is_neither_merged_nor_played(run: Path) -> None:
    replaced(PLAN_FILE, sparse(3 << 30))(run)
    for reader in (merge, lambda run: read_plan_file(str(run / PLAN_FILE))):
        assert re.search(r"plan\.json has more than", refusal(reader, run))


LAUGHS = "a: &a [x, x]\n" + "".join(
    f"{name}: &{name} [{', '.join([f'*{before}'] * 10)}]\n"
    for before, name in itertools.pairwise("abcdefghi")
)

PLAN_FILES: Mapping[str, tuple[str, str]] = {
    "billion laughs": (LAUGHS + "tasks: *i\n", "alias"),
    "list in itself": ("tasks: &a [*a]\n", "alias"),
    "Python object": ("tasks: !!python/object/apply:os.abort []\n", "not valid YAML"),
    "deep nesting": ("tasks: " + "[" * 20_000, "nested too deeply"),
    "number of 10,000 digits": ("max_steps: " + "9" * 10_000, "not valid YAML"),
    "date that cannot be": ("split: 2020-99-99", "line 1 has 2020-99-99"),
    "key twice": ("tasks: all\ntasks: all\n", "again"),
    "list as key": ("? [tasks]\n: all\n", "not valid YAML"),
}


@pytest.mark.parametrize("make", [os.mkfifo, link("/dev/zero")], ids=["pipe", "device"])
def test_plan_files_are_regular_files(make: Callable[[Path], object], tmp_path: Path) -> None:
    make(tmp_path / "plan.yaml")
    message = refusal(lambda folder: read_plan_file(str(folder / "plan.yaml")), tmp_path)
    assert message.endswith("is not a regular file.")


@pytest.mark.parametrize("name", PLAN_FILES)
def test_plan_files_are_refused(name: str, tmp_path: Path) -> None:
    content, says = PLAN_FILES[name]
    path = tmp_path / "plan.yaml"
    path.write_text(content)
    message = refusal(lambda path: read_plan_file(str(path)), path)
    assert says in message
    assert "plan.yaml" in message


def _npy(header: str, payload: bytes = b"") -> bytes:
    text = header.encode() + b" " * (-(len(header) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text + payload


def _header(shape: str, kind: str = "'<f8'") -> str:
    return f"{{'descr': {kind}, 'fortran_order': False, 'shape': {shape}, }}"


def _rows(content: bytes) -> Callable[[bytes], bytes]:
    def build(good: bytes) -> bytes:
        with zipfile.ZipFile(io.BytesIO(good)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        return zipped({**members, "rows.npy": content})

    return build


def zipped(members: Mapping[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


def _headers_with(offset: int, value: int) -> Callable[[bytes], bytes]:
    """Change a number in all headers of an archive, local and central."""

    def build(good: bytes) -> bytes:
        content = bytearray(good)
        for mark, shift in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):
            for found in re.finditer(re.escape(mark), good):
                struct.pack_into("<H", content, found.start() + offset + shift, value)
        return bytes(content)

    return build


ENCRYPTED, UNKNOWN_METHOD = _headers_with(6, 1), _headers_with(8, 99)

ACTION_FILES: Mapping[str, Callable[[bytes], bytes]] = {
    "10**12 rows": _rows(_npy(_header("(1000000000000, 8)"))),
    "10**30 rows": _rows(_npy(_header(f"({10**30}, 8)"))),
    "shape of truth values": _rows(_npy(_header("(True, 8)"), bytes(64))),
    "rows of structs": _rows(_npy(_header("(20,)", "[('a', '<f8'), ('b', '<f8')]"), bytes(320))),
    "complex rows": _rows(_npy(_header("(3, 8)", "'<c16'"), bytes(384))),
    "dates": _rows(_npy(_header("(3, 8)", "'<M8[s]'"), bytes(192))),
    "pickled rows": _rows(_npy(_header("(1,)", "'|O'"), b"\x80\x04cos\nsystem\n.")),
    "code in a header": _rows(_npy("__import__('os').abort()")),
    "encrypted": ENCRYPTED,
    "unknown compression": UNKNOWN_METHOD,
    "bomb": _rows(_npy(_header("(3, 8)"), bytes(20_000_000))),
    "no archive": lambda _good: b"x" * 100,
}


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("name", ACTION_FILES)
def test_action_files_are_refused(name: str, run: Path) -> None:
    path = run / _action_name(run)
    path.write_bytes(ACTION_FILES[name](path.read_bytes()))
    digest = line_of(run)["action_log"]
    assert "is not an action log" in refusal(lambda folder: read_actions(folder, digest), run)
    assert fit(verify(run)).count("is not an action log") == 2  # both records name it


def _repacked(change: Callable[[dict[str, bytes]], object]) -> Callable[[bytes], bytes]:
    """Change the files of a pack; its manifest then names what there is."""

    def build(good: bytes) -> bytes:
        with zipfile.ZipFile(io.BytesIO(good)) as archive:
            members = {name: archive.read(name) for name in archive.namelist()}
        change(members)
        manifest = json.loads(members.pop(MANIFEST))
        manifest["files"] = {
            name: hashlib.sha256(content).hexdigest() for name, content in members.items()
        }
        return zipped({MANIFEST: json.dumps(manifest).encode(), **members})

    return build


def _with(name: str) -> Callable[[bytes], bytes]:
    return _repacked(lambda members: members.update({name: b"evil"}))


def _swollen(good: bytes) -> bytes:
    """Let the archive say of all files but the manifest that they have 4 GiB."""
    content = bytearray(good)
    for found in re.finditer(rb"PK\x01\x02", good):
        if not good.startswith(MANIFEST.encode(), found.start() + 46):
            struct.pack_into("<I", content, found.start() + 24, (4 << 30) - 2)
    return bytes(content)


PACKS: Mapping[str, tuple[Callable[[bytes], bytes], str]] = {
    "absolute path": (_with("/var/evil"), "not belong to a run"),
    "path that leaves": (_with("actions/../../evil"), "not belong to a run"),
    "Windows path": (_with("actions\\..\\..\\evil"), "not belong to a run"),
    "file of another kind": (_with("x"), "not belong to a run"),
    "name in bidi marks": (_with("logs/\u202egol"), "not belong to a run"),
    "name of 60,000 letters": (_with("logs/" + "a" * 60_000), "not belong to a run"),
    "name with a line end": (_with("logs/a.txt\n"), "not belong to a run"),
    "encrypted": (ENCRYPTED, "not a packed run"),
    "unknown compression": (UNKNOWN_METHOD, "not a packed run"),
    "cut short": (lambda good: good[:-100], "not a packed run"),
    "says it is huge": (_swollen, "unpacks to more than 20 GiB"),
    "records of 70 MB of blanks": (
        _repacked(lambda all_: all_.update({RECORDS_FILE: b" " * 70_000_000})),
        "more than",
    ),
}


@pytest.mark.parametrize("name", PACKS)
def test_packs_are_refused(name: str, run: Path) -> None:
    build, says = PACKS[name]
    path = pack(run)
    path.write_bytes(build(path.read_bytes()))
    before = sorted(run.parent.rglob("*"))

    def read(path: Path) -> None:
        with opened_run(path) as folder:
            verify_run(folder, sample=0)

    assert says in refusal(read, path)
    assert sorted(run.parent.rglob("*")) == before


WORDINGS = """name = "workshop"
tasks = ["PickXtimes"]
commands.all = ["pick up {color} {repeats}"]
stated.all = { color = "the {color} cube" }
[[literal]]
task = "PickXtimes"
when = { color = "red", repeats = 2 }
text = "the usual"
"""

WORDING_FILES: Mapping[str, tuple[str, str]] = {
    "deep list": ("a=" + "[" * 50_000, "not valid TOML"),
    "deep tables": ("a=" + "{a=" * 3_000 + "1" + "}" * 3_000, "not valid TOML"),
    "key of 20,000 parts": (".".join("a" * 20_000) + "=1", "more than 20 parts"),
    "quoted key of 20,000 parts": (".".join(['"a"'] * 20_000) + "=1", "more than 20 parts"),
    "number of 10,000 digits": ("name=" + "9" * 10_000, "not valid TOML"),
    "command of 1 MB": (WORDINGS.replace("pick up", "pick up " + "very " * 200_000), "characters"),
    "sentence of 1 MB": (WORDINGS.replace("usual", "usual " * 250_000), "characters"),
    "file of 4 MB": (WORDINGS + "#" * 4_000_000, "has more than 4,000,000 bytes"),
    "field of an attribute": (WORDINGS.replace("{color}", "{0.__class__}"), "bracket"),
    "field of an item": (WORDINGS.replace("{color}", "{color.__init__}"), "bracket"),
    "format specification": (WORDINGS.replace("{color}", "{color:>1000000000}"), "bracket"),
    "escape in a sentence": (WORDINGS.replace("usual", "\\u001b[31m"), "must be"),
    "path as name": (WORDINGS.replace("workshop", "../../evil"), "a word of letters"),
    "YAML": ("a: &a [x, x]\nb: [*a, *a]\n", "not valid TOML"),
    "byte order mark": ("\ufeff" + WORDINGS, "not valid TOML"),
}


@pytest.mark.parametrize("name", WORDING_FILES)
def test_wording_files_are_refused(name: str, tmp_path: Path) -> None:
    content, says = WORDING_FILES[name]
    path = tmp_path / "words.toml"
    path.write_text(content)
    message = refusal(read_wordings, path)
    assert says in message
    assert "words.toml" in message


def test_the_honest_wording_file_is_read(tmp_path: Path) -> None:
    (tmp_path / "words.toml").write_text(WORDINGS)
    assert set(read_wordings(tmp_path / "words.toml").tasks) == {"PickXtimes"}


def test_the_honest_run_goes_through_every_reader(run: Path) -> None:
    assert len(read_records(run)) == 2
    assert len(read_records(merge(run))) == 2
    with opened_run(pack(run)) as folder:
        assert len(read_records(folder)) == 2
    assert report(run).is_file()
    assert len(read_plans(run)) == 1
