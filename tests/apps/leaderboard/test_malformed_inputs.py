"""Malformed runs, packs, plans and wording files: one sentence or an answer, and nothing outside.

Each attack changes an honest run, then reads it. Without a simulator; what replays say about forged
actions is in test_verification.py.
"""

import hashlib
import io
import json
import os
import re
import shutil
import struct
import zipfile

import pytest

from roboirg.analysis.page.report import write_report
from roboirg.analysis.results.sources import Source
from roboirg.apps.leaderboard.packing import pack_run
from roboirg.apps.leaderboard.run_verification import verify_run
from roboirg.core.errors import RoboIRGError
from roboirg.language.scenarios.wording_file import read_wordings
from roboirg.records.action_log import ACTION_FOLDER, action_path, read_actions
from roboirg.records.merging import merge_runs
from roboirg.records.packs import MANIFEST, opened_run
from roboirg.records.run_files import PLAN_FILE
from roboirg.records.store import (
    RECORDS_FILE,
    read_records,
)
from roboirg.runs.plan.plan_file import read_plan_file
from roboirg.runs.plan.stored_plans import read_plans

LONGEST_MESSAGE = 1_500


def pack(run):
    out = run.parent / "mine.roboirg.zip"
    pack_run(run, out, videos=True, logs=True)
    return out


def merge(run):
    merge_runs([run], run.parent / "merged")
    return run.parent / "merged"


def read_pack(path):
    with opened_run(path) as folder:
        assert read_records(folder)


def report(run):
    pytest.importorskip("jinja2")
    return write_report(Source(run))


def verify(run):
    return "\n".join(
        finding for check in verify_run(run, sample=0).checks for finding in check.findings
    )


def refusal(reader, path):
    """Return the one sentence in which something is refused."""
    with pytest.raises(RoboIRGError) as caught:
        reader(path)
    return fit(str(caught.value))


def fit(message):
    """Return a message, which must be short and without the words of a validator."""
    assert len(message) < LONGEST_MESSAGE
    assert "matching regex" not in message
    return message


def cases(arguments, by_name):
    """Run a test for each entry of a table, under its name."""
    return pytest.mark.parametrize(arguments, by_name.values(), ids=by_name)


def line_of(run):
    """Return the first record as it is stored."""
    return json.loads((run / RECORDS_FILE).read_text().splitlines()[0])


def option(**changes):
    """Change instruction options of the first record."""
    return lambda run: record(options={**line_of(run)["options"], **changes})(run)


def record(**changes):
    """Change fields of the first record."""

    def change(run):
        lines = (run / RECORDS_FILE).read_text().splitlines()
        lines[0] = json.dumps({**json.loads(lines[0]), **changes})
        (run / RECORDS_FILE).write_text("\n".join(lines) + "\n")

    return change


def raw(old, new):
    """Replace bytes of the file of records."""

    def change(run):
        content = (run / RECORDS_FILE).read_bytes()
        assert old in content
        (run / RECORDS_FILE).write_bytes(content.replace(old, new, 1))

    return change


def replaced(name, make):
    """Put something else in the place of a file or folder."""

    def change(run):
        path = run / name
        path.parent.mkdir(exist_ok=True)
        if path.is_dir():
            shutil.rmtree(path)
        path.unlink(missing_ok=True)
        make(path)

    return change


def link(target):
    """Return what makes a path a link to a target."""
    return lambda path: path.symlink_to(target)


def sparse(size):
    """Return what makes a path a file of so many bytes, which take no room on the disk."""

    def make(path):
        path.touch()
        os.truncate(path, size)

    return make


def planned(**changes):
    """Change entries of the stored plan."""

    def change(run):
        plan = json.loads((run / PLAN_FILE).read_text())
        (run / PLAN_FILE).write_text(json.dumps({**plan, **changes}))

    return change


@pytest.mark.parametrize("reader", [read_records, pack])
@cases(
    ("change", "complaint"),
    {
        "step limit of 10**30": (
            record(environment={"max_steps": 10**30}),
            r"\$\.environment\.max_steps",
        ),
        "seed of 10**40": (record(seed=10**40), r"\$\.seed"),
        "a million stages": (option(stages=[1] * 1_000_000), "length <= 100"),
        "cause of 5 MB": (record(outcome="failure", cause="x" * 5_000_000), r"\$\.cause"),
        "version in bidi marks": (record(language_version="\u202e0.0.2"), "control characters"),
        "policy that is a formula": (record(policy="=cmd|' /C calc'!A0"), "none of = [+] - @"),
        "setting that is a formula": (option(setting="+1+1"), "none of = [+] - @"),
        "video outside": (record(video="videos/../../secret.mp4"), "path below"),
        "line of 65 MiB": (
            lambda run: os.truncate(run / RECORDS_FILE, 65 << 20),
            "line 3 has more than",
        ),
        "pipe": (replaced(RECORDS_FILE, os.mkfifo), "not a regular file"),
        "circle of links": (replaced(RECORDS_FILE, link(RECORDS_FILE)), "symbolic links"),
    },
)
def test_records_that_are_none_are_refused_by_the_name_of_their_file(
    change, complaint, reader, run
):
    """Each change spoils the first of two records, or the file; reading and packing both refuse it.

    `complaint` is a pattern of the one sentence (`$` is the record), which also names the file.
    """
    change(run)

    message = refusal(reader, run)

    assert re.search(complaint, message)
    assert RECORDS_FILE in message


@pytest.mark.parametrize("reader", [read_records, merge])
@cases(
    ("change", "complaint"),
    {
        "event at step 10**25": (
            record(events=[{"step": 10**25, "kind": "home", "subject": "robot"}]),
            r"\$\.events\[0\]\.step",
        ),
        "field of a mention that no version has": (
            record(mentions=[{"luck": 1}]),
            "unknown field `luck`",
        ),
        "field that no version has": (record(mentions=[], luck=1), "unknown field `luck`"),
    },
)
def test_fields_that_packs_hold_unread_are_refused_by_who_reads_them(
    change, complaint, reader, run
):
    """A step that is too large, and fields that no version of records has, as `luck`.

    Packing doesn't read these fields; reading and merging do, and name field and file.
    """
    change(run)

    message = refusal(reader, run)

    assert re.search(complaint, message)
    assert RECORDS_FILE in message


DAMAGE = {
    "bytes that are no UTF-8": raw(b'"policy":"random"', b'"policy":"\xff"'),
    "lone surrogate": raw(b'"policy":"random"', b'"policy":"\\udfff"'),
    "deep nesting": raw(b'"policy_metadata":{', b'"policy_metadata":{"a":' + b"[" * 200_000),
}


@pytest.mark.parametrize("reader", [pack, verify])
@cases("damage", DAMAGE)
def test_a_run_with_a_damaged_line_is_refused(damage, reader, run):
    """`DAMAGE` spoils the first of two lines of records, so that it can't be decoded."""
    damage(run)
    assert "has 1 damaged line, the first is line 1" in refusal(reader, run)


@cases("damage", DAMAGE)
def test_merging_warns_of_a_damaged_line_and_leaves_it_out(damage, run, caplog):
    """`DAMAGE` spoils the first of two records; the second one is what the merged run has."""
    damage(run)

    merged = merge(run)

    (warning,) = caplog.messages
    assert f"{run / RECORDS_FILE} has 1 damaged line, the first is line 1" in warning
    assert len(read_records(merged)) == 1
    pack(merged)  # is not refused any more


def test_a_mark_of_byte_order_before_the_only_line_is_named(run):
    line = (run / RECORDS_FILE).read_bytes().splitlines(keepends=True)[0]
    (run / RECORDS_FILE).write_bytes(b"\xef\xbb\xbf" + line)
    assert "has 1 damaged line, the first is line 1" in refusal(read_records, run)


def lead_out(run, name):
    """Move a file or folder of the run outside, and put a link to it in its place."""
    path = next(run.glob(name), run / name)
    outside = run.parent / "secret.txt"
    path.parent.mkdir(exist_ok=True)
    if path.is_dir():
        outside = path.rename(run.parent / "outside")
    path.unlink(missing_ok=True)
    path.symlink_to(outside)


@pytest.mark.parametrize("reader", [pack, merge], ids=lambda reader: reader.__name__)
@pytest.mark.parametrize(
    "name", ["logs", "logs/*.txt", "actions/*/*.npz", "videos/*.mp4", PLAN_FILE, "plans/1.json"]
)
def test_links_that_lead_out_of_a_run_are_not_followed(name, reader, run):
    """A file or folder of the run becomes a link to a secret outside: refused, and copied
    nowhere.
    """
    lead_out(run, name)

    assert "link leads elsewhere" in refusal(reader, run)

    secret = (run.parent / "secret.txt").read_bytes()
    for path in run.parent.rglob("*"):
        if path.is_file() and not path.is_symlink() and path.name != "secret.txt":
            assert path.read_bytes() != secret, path


@pytest.mark.parametrize("name", ["videos", "videos/*.mp4", "videos/*.jpg"])
def test_the_page_embeds_nothing_from_outside(name, run):
    """Videos or posters of the run become links to a secret outside, and the page is refused."""
    lead_out(run, name)
    assert "link leads elsewhere" in refusal(report, run)


def test_the_page_follows_no_circle_of_links(run):
    """A video of the run is a link to itself, which could be followed for ever."""
    video = next(run.glob("videos/*.mp4"))
    video.unlink()
    video.symlink_to(video.name)

    assert "link leads elsewhere" in refusal(report, run)


def test_a_poster_of_10_gib_is_not_embedded(run):
    """The poster is a file of 10 GiB (sparse, so without room on the disk); the page is small."""
    sparse(10 << 30)(next(run.glob("videos/*.jpg")))
    assert report(run).stat().st_size < 20 << 20


def test_a_run_of_a_tebibyte_is_refused_before_it_is_packed(run):
    """A log has 1 << 40 bytes (sparse); no half-written pack (`.part`) is left."""
    replaced("logs/large.txt", sparse(1 << 40))(run)

    assert "logs/large.txt" in refusal(pack, run)
    assert not list(run.parent.glob("*.part"))


def test_hidden_files_and_pipes_are_not_packed(run):
    """Two files join the logs, a hidden one and a pipe: all others are packed."""
    (run / "logs" / ".DS_Store").touch()
    os.mkfifo(run / "logs" / "pipe.txt")

    with opened_run(pack(run)) as folder:
        names = {path.name for path in (folder / "logs").iterdir()}

    assert names == {path.name for path in (run / "logs").iterdir()} - {".DS_Store", "pipe.txt"}


def test_a_plan_of_900_000_jobs_is_read(run):
    """9,000 seeds times 50 episodes times two policies; a million is the limit."""
    planned(policy_seeds=list(range(9_000)), episodes=list(range(50)))(run)
    assert len(read_plans(run)) == 1


@cases(
    "change",
    {
        "1,200,000 jobs": planned(policy_seeds=list(range(12_000)), episodes=list(range(50))),
        "no seeds": planned(policy_seeds=[]),
        "policy that controls the terminal": planned(policies=["\x1b[31m"]),
        "split of half a character": planned(split="\ud800"),
        "deep nesting": replaced(PLAN_FILE, lambda path: path.write_text("[" * 200_000)),
        "pipe": replaced(PLAN_FILE, os.mkfifo),
        "none": lambda run: (run / PLAN_FILE).unlink(),
        "3 GB": replaced(PLAN_FILE, sparse(3 << 30)),
    },
)
def test_a_stored_plan_that_cannot_be_counts_as_missing(change, run):
    """The plan of a run is gone, spoiled or too large; its two records then come from no plan."""
    change(run)

    assert read_plans(run) == ()
    assert verify_run(run, sample=0).faults == ("2 records from no plan that is kept.",)


@pytest.mark.parametrize(
    "reader", [merge, lambda run: read_plan_file(str(run / PLAN_FILE))], ids=["merged", "played"]
)
def test_a_plan_of_3_gb_is_neither_merged_nor_played(reader, run):
    """The plan is a sparse file of 3 << 30 bytes, and refused by its size."""
    replaced(PLAN_FILE, sparse(3 << 30))(run)

    assert "plan.json has more than" in refusal(reader, run)


@pytest.mark.parametrize("make", [os.mkfifo, link("/dev/zero")], ids=["pipe", "device"])
def test_plan_files_are_regular_files(make, tmp_path):
    make(tmp_path / "plan.yaml")
    message = refusal(lambda folder: read_plan_file(str(folder / "plan.yaml")), tmp_path)
    assert message.endswith("is not a regular file.")


@cases(
    ("content", "complaint"),
    {
        "Python object": ("tasks: !!python/object/apply:os.abort []\n", "not valid YAML"),
        "deep nesting": ("tasks: " + "[" * 20_000, "nested too deeply"),
        "number of 10,000 digits": ("max_steps: " + "9" * 10_000, "not valid YAML"),
        "date that cannot be": ("split: 2020-99-99", "line 1 has 2020-99-99"),
    },
)
def test_plan_files_with_other_content_are_refused_by_name(content, complaint, tmp_path):
    """Each content is YAML that starts code, fills the memory or raises an error of the reader."""
    path = tmp_path / "plan.yaml"
    path.write_text(content)

    message = refusal(lambda path: read_plan_file(str(path)), path)

    assert complaint in message
    assert "plan.yaml" in message


def _rows(shape, payload=b"", kind="<f8"):
    """Replace the rows by a file of NumPy's with this header and content."""
    header = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    header += b" " * (-(len(header) + 11) % 64) + b"\n"
    content = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + payload
    return lambda good: zipped({**members_of(good), "rows.npy": content})


def members_of(good):
    with zipfile.ZipFile(io.BytesIO(good)) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def zipped(members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return file.getvalue()


def _headers_with(offset, value):
    """Change a number in all headers of an archive, local and central."""

    def build(good):
        content = bytearray(good)
        for mark, shift in ((b"PK\x03\x04", 0), (b"PK\x01\x02", 2)):
            for found in re.finditer(re.escape(mark), good):
                struct.pack_into("<H", content, found.start() + offset + shift, value)
        return bytes(content)

    return build


ENCRYPTED = _headers_with(6, 1)
UNKNOWN_METHOD = _headers_with(8, 99)


@pytest.mark.filterwarnings("error")
@cases(
    "damaged",
    {
        "10**12 rows": _rows("(1000000000000, 8)"),
        "code in a header": _rows("__import__('os').abort()"),
        "encrypted": ENCRYPTED,
        "unknown compression": UNKNOWN_METHOD,
        "bomb": _rows("(3, 8)", bytes(20_000_000)),
    },
)
def test_action_files_that_are_none_are_refused_and_named_by_verify(damaged, run):
    """A file of actions is an archive of NumPy's arrays; `damaged` makes other bytes of a good one.

    Its header then says a size that the content does not have, or code, or the archive says that
    its files are encrypted or compressed in an unknown way, or it has 20 MB instead of three rows.
    Both records of the run name this file, so that `verify` tells of it twice.
    """
    digest = line_of(run)["action_log"]
    path = action_path(run, digest)
    path.write_bytes(damaged(path.read_bytes()))

    message = refusal(lambda folder: read_actions(folder, digest), run)

    assert "is not an action log" in message
    assert fit(verify(run)).count("is not an action log") == 2


def _with(changes, *, manifest_fits=True):
    """Change the files of a pack; its manifest then names what there is, or what there was."""

    def build(good):
        members = {**members_of(good), **changes}
        if manifest_fits:
            manifest = json.loads(members.pop(MANIFEST))
            manifest["files"] = {
                name: hashlib.sha256(content).hexdigest() for name, content in members.items()
            }
            members[MANIFEST] = json.dumps(manifest).encode()
        return zipped(members)

    return build


def _manifest_with(**entries):
    def build(good):
        manifest = json.loads(members_of(good)[MANIFEST])
        changed = json.dumps({**manifest, **entries}).encode()
        return _with({MANIFEST: changed}, manifest_fits=False)(good)

    return build


def _without(name):
    def build(good):
        members = members_of(good)
        del members[name]
        return zipped(members)

    return build


def _swollen(good, only=b""):
    """Let the archive say of all files but the manifest that they have 4 GiB, or of some only."""
    content = bytearray(good)
    for found in re.finditer(rb"PK\x01\x02", good):
        name_start = found.start() + 46
        is_meant = good.startswith(only, name_start)
        if is_meant and not good.startswith(MANIFEST.encode(), name_start):
            struct.pack_into("<I", content, found.start() + 24, (4 << 30) - 2)
    return bytes(content)


@cases(
    ("build", "complaint"),
    {
        "absolute path": (_with({"/var/evil": b""}), "not belong to a run"),
        "path that leaves": (_with({"actions/../../evil": b""}), "not belong to a run"),
        "Windows path": (_with({"actions\\..\\..\\evil": b""}), "not belong to a run"),
        "name of 60,000 letters": (_with({"logs/" + "a" * 60_000: b""}), "not belong to a run"),
        "other records": (
            _with({RECORDS_FILE: b"{}\n"}, manifest_fits=False),
            "is not the file that its manifest names",
        ),
        "file more": (_with({"more.txt": b"x"}, manifest_fits=False), "exactly the files"),
        "no records": (_without(RECORDS_FILE), "exactly the files"),
        "no manifest": (_without(MANIFEST), "cannot be read"),
        "empty manifest": (_with({MANIFEST: b"{}"}, manifest_fits=False), "cannot be read"),
        "other format": (_manifest_with(format=2), "of format 2; this roboirg reads format 1"),
        "negative number of records": (_manifest_with(records=-1), "cannot be read"),
        "encrypted": (ENCRYPTED, "not a packed run"),
        "unknown compression": (UNKNOWN_METHOD, "not a packed run"),
        "cut short": (lambda good: good[:-100], "not a packed run"),
        "says it is huge": (_swollen, "unpacks to more than 20 GiB"),
        "records of 70 MB of blanks": (_with({RECORDS_FILE: b" " * 70_000_000}), "more than"),
    },
)
def test_a_pack_that_is_none_is_refused_and_leaves_nothing_behind(build, complaint, run):
    """`build` makes the bytes of a bad pack from those of a good one.

    It is refused with this complaint, and the folder has the same files as before.
    """
    path = pack(run)
    path.write_bytes(build(path.read_bytes()))
    files_before = sorted(run.parent.rglob("*"))

    message = refusal(read_pack, path)

    assert complaint in message
    assert sorted(run.parent.rglob("*")) == files_before


@pytest.fixture
def pack_with_huge_videos(run, monkeypatch):
    """A pack whose archive says of its four files in videos/ that each unpacks to 4 GiB.

    At most 10 GiB may be unpacked here.
    """
    monkeypatch.setattr("roboirg.records.packs.MOST_PACKED_BYTES", 10 << 30)
    path = pack(run)
    path.write_bytes(_swollen(path.read_bytes(), only=b"videos/"))
    return path


def test_what_a_command_does_not_read_of_a_pack_is_not_unpacked(pack_with_huge_videos):
    """A pack is a zip file. `pack_with_huge_videos` says that its videos unpack to more than the
    limit. Who asks for the folder of actions alone gets the two records, without videos.
    """
    with opened_run(pack_with_huge_videos, [ACTION_FOLDER]) as folder:
        assert len(read_records(folder)) == 2
        assert not (folder / "videos").exists()


def test_a_pack_of_videos_that_are_too_large_is_refused_by_who_reads_them(pack_with_huge_videos):
    """`read_pack` unpacks all; the videos say 16 GiB, and 10 GiB are the limit here."""
    assert "unpacks to more than" in refusal(read_pack, pack_with_huge_videos)


def test_a_warning_about_a_pack_names_the_pack(run, caplog):
    """A line that is no record is added to the file of records in a good pack, mine.roboirg.zip.

    Its manifest is made to fit, so that the pack is read, with a warning about the line.
    """
    path = pack(run)
    records = (run / RECORDS_FILE).read_bytes() + b"damaged\n"
    add_damaged_line = _with({RECORDS_FILE: records})
    path.write_bytes(add_damaged_line(path.read_bytes()))

    read_pack(path)

    assert "mine.roboirg.zip/records.jsonl has 1 damaged line" in caplog.text


WORDINGS = """name = "workshop"
tasks = ["PickXtimes"]
commands.all = ["pick up {color} {repeats}"]
stated.all = { color = "the {color} cube" }
"""


@cases(
    ("content", "complaint"),
    {
        "deep tables": ("a=" + "{a=" * 3_000 + "1" + "}" * 3_000, "not valid TOML"),
        "key of 20,000 parts": (".".join("a" * 20_000) + "=1", "more than 20 parts"),
        "command of 1 MB": (
            WORDINGS.replace("pick up", "pick up " + "very " * 200_000),
            "characters",
        ),
        "file of 4 MB": (WORDINGS + "#" * 4_000_000, "has more than 4,000,000 bytes"),
        "field of an attribute": (WORDINGS.replace("{color}", "{0.__class__}"), "bracket"),
    },
)
def test_wording_files_that_are_malformed_or_huge_are_refused_by_name(content, complaint, tmp_path):
    """Each content is a file that is no TOML, or goes beyond a limit, or reads an attribute."""
    path = tmp_path / "words.toml"
    path.write_text(content)

    message = refusal(read_wordings, path)

    assert complaint in message
    assert "words.toml" in message


def test_the_honest_wording_file_is_read(tmp_path):
    (tmp_path / "words.toml").write_text(WORDINGS)
    assert set(read_wordings(tmp_path / "words.toml").tasks) == {"PickXtimes"}
