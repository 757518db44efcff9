"""Play episodes on odd machines, and write what happens into docs/tested.md; by hand, as root.

Each machine is a mount namespace (``unshare -m``) with other folders, users or variables; nothing
outside it changes. Names after the command choose machines, and then only a table is printed.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import NamedTuple

import sapien
from written_parts import table, with_part

from roboirg.simulation.model_files import find_model_files

ROOT = Path(__file__).parents[1]
PAGE = ROOT / "docs" / "tested.md"
TIMEOUT_S = 900.0
POLICY = """\
class Still:
    def reset(self, *heard, **more):
        print("→ ü")

    def act(self, observation):
        return [0, 0.39, 0, -1.96, 0, 2.36, 0.785, 1]
"""
CLOCK = """\
#define _GNU_SOURCE
#include <dlfcn.h>
#include <stdlib.h>
#include <time.h>

int clock_gettime(clockid_t clock, struct timespec *now) {
  int (*real)(clockid_t, struct timespec *) = dlsym(RTLD_NEXT, "clock_gettime");
  int code = real(clock, now);
  if (clock == CLOCK_REALTIME && now->tv_sec >= atol(getenv("JUMPS_AT"))) now->tv_sec -= 3600;
  return code;
}
"""
OTHERS = ("still:Still", "server", "model")
RUN = """\
cd "$PLACE"
"$PYTHON" -m roboirg serve still:Still --protocol openpi --port "$SERVED" >served 2>&1 &
"$PYTHON" -m roboirg run --policy oracle --policy still:Still \
  --policy "server=openpi://127.0.0.1:$SERVED" \
  --policy "model=vlm-listener:openai?base_url=http://127.0.0.1:$ASKED/v1&model=m&retries=0" \
  --tasks VideoUnmask --settings explicit --episodes 1 --max-steps 120 --workers 2 --out out
code=$?
kill %1
exit $code
"""
"""Policies of four kinds: in the worker, in a process of its own, behind a websocket, a model."""

NO_HOME = """\
mkdir "$PLACE/python" "$PLACE/models"
mount --bind "$BASE" "$PLACE/python"
mount --bind "$MODELS" "$PLACE/models"
mount -t tmpfs -o mode=755 none "$HOME"
mkdir -p "$BASE"
mount --bind "$PLACE/python" "$BASE"
chmod 777 "$PLACE"
"""
NEW_DEV = """\
mkdir "$PLACE/dev"
for one in null zero full random urandom tty; do
  touch "$PLACE/dev/$one"
  mount --bind "/dev/$one" "$PLACE/dev/$one"
done
mount --bind "$PLACE/dev" /dev
"""
NOBODY = "setpriv --reuid 4242 --regid 4242 --clear-groups env -u HOME"
UNKNOWN = "! getent passwd 4242 && as sh -c 'test -z \"$HOME\" && ! test -w /root'"
PROXY = "http://127.0.0.1:9"
SOCKS = "socks5://127.0.0.1:9"


class Machine(NamedTuple):
    """A machine.

    Attributes:
        name: for the table.
        prepare: shell commands in its namespace.
        probe: shell command that succeeds only where the machine is as its name says.
        variables: of the environment, as in a shell.
        user: command that goes on as its user, with variables.
        place: name of that folder.
    """

    name: str
    prepare: str = ""
    probe: str = "true"
    variables: str = ""
    user: str = "env"
    place: str = "place"


def encoding(name: str) -> str:
    """Return the probe of an output encoding."""
    return f'as "$PYTHON" -c \'import sys; assert sys.stdout.encoding == "{name}"\''


MACHINES = (
    Machine("as usual"),
    Machine("no `/dev/shm`", NEW_DEV, "! test -e /dev/shm"),
    Machine(
        "`/dev/shm` read-only",
        "mount -t tmpfs -o ro none /dev/shm",
        "! touch /dev/shm/x",
    ),
    Machine(
        "`/dev/shm` full",
        "mount -t tmpfs -o size=4k none /dev/shm; head -c 9999 /dev/zero >/dev/shm/x || true",
        "! head -c 9999 /dev/zero >/dev/shm/y",
    ),
    Machine(
        "no HOME, no entry for the user",
        NO_HOME,
        UNKNOWN,
        'ROBOIRG_MODEL_FILES="$PLACE/models"',
        user=NOBODY,
    ),
    Machine(
        "the same, and model files nowhere",
        NO_HOME,
        UNKNOWN,
        user=NOBODY,
    ),
    Machine(
        "HOME read-only, nothing cached",
        'mkdir "$PLACE/home"; mount --bind "$PLACE/home" "$PLACE/home"\n'
        'mount -o remount,bind,ro "$PLACE/home"',
        '! touch "$PLACE/home/x"',
        'HOME="$PLACE/home" ROBOIRG_MODEL_FILES="$MODELS"',
    ),
    Machine(
        "Latin-1 locale",
        'mkdir "$PLACE/l"; localedef -i en_US -f ISO-8859-1 "$PLACE/l/en_US.ISO-8859-1" || true',
        encoding("iso8859-1"),
        'LOCPATH="$PLACE/l" LC_ALL=en_US.ISO-8859-1 PYTHONUTF8=0',
    ),
    Machine("POSIX locale", "", encoding("utf-8"), "LC_ALL=POSIX"),
    Machine(
        "C locale, which Python does not change to UTF-8",
        "",
        encoding("ascii"),
        "LC_ALL=C PYTHONCOERCECLOCALE=0 PYTHONUTF8=0",
    ),
    Machine("`PYTHONIOENCODING=ascii`", "", encoding("ascii"), "PYTHONIOENCODING=ascii"),
    Machine("TMPDIR missing", "", "! test -e /nowhere", "TMPDIR=/nowhere"),
    Machine(
        "a dead proxy in every variable",
        "",
        "! timeout 5 bash -c 'echo >/dev/tcp/127.0.0.1/9'",
        f"http_proxy={PROXY} https_proxy={PROXY} HTTP_PROXY={PROXY} HTTPS_PROXY={PROXY} "
        f"ALL_PROXY={SOCKS} all_proxy={SOCKS} NO_PROXY=models.lab",
    ),
    Machine(
        "only a SOCKS proxy",
        "",
        '! "$PYTHON" -c "import socksio"',
        f"ALL_PROXY={SOCKS} NO_PROXY=[::1]/128",
    ),
    Machine(
        "a clock that jumps back an hour",
        'printf %s "$CLOCK" >"$PLACE/clock.c"\n'
        'gcc -shared -fPIC -o "$PLACE/clock.so" "$PLACE/clock.c" -ldl',
        'as env JUMPS_AT=0 "$PYTHON" -c "import time; assert time.time() < $(date +%s) - 3000"',
        'LD_PRELOAD="$PLACE/clock.so" JUMPS_AT=$(($(date +%s) + 8))',
    ),
    Machine(
        "a path with blanks and ü",
        'mkdir "$PLACE/models ü"; mount --bind "$MODELS" "$PLACE/models ü"',
        'test -e "$PLACE/models ü/utils"',
        'HOME="$PLACE" ROBOIRG_MODEL_FILES="$PLACE/models ü"',
        place="ein Ordner mit ü",
    ),
    Machine(
        "package folders read-only",
        'for one in "$PACKAGE" "$SITE"; do\n'
        '  mount --bind "$one" "$one"; mount -o remount,bind,ro "$one"; done',
        '! touch "$PACKAGE/x" && ! touch "$SITE/x"',
        "-u PYTHONDONTWRITEBYTECODE",
    ),
)


class Answer(BaseHTTPRequestHandler):
    """A model that always gives the same answer."""

    def do_POST(self) -> None:
        """Answer."""
        body = json.dumps({"choices": [{"message": {"content": "none"}}]}).encode()
        self.rfile.read(int(self.headers["Content-Length"]))
        self.send_response(200)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)

    def log_message(self, *_: object) -> None:
        """Print nothing."""


def play(machine: Machine, asked: int, place: Path) -> tuple[str, list[str]]:
    """Play on a machine; return what happened, and the lines of its doctor.

    Args:
        machine: the machine.
        asked: port of the model.
        place: a new folder.
    """
    place.mkdir()
    (place / "still.py").write_text(POLICY, encoding="utf-8")
    package = ROOT / "src" / "roboirg"
    variables = {"PLACE": place, "PYTHON": sys.executable, "BASE": sys.base_prefix, "CLOCK": CLOCK}
    variables |= {"MODELS": find_model_files(), "PACKAGE": package, "RUN": RUN}
    variables |= {"SITE": Path(sapien.__file__).parents[1], "ASKED": asked, "SERVED": asked + 1}
    script = (
        f'set -e\nas() {{ {machine.user} {machine.variables} "$@"; }}\n{machine.prepare}\n'
        f'if ! {{ {machine.probe}; }} 2>"$PLACE/probe"; then exit 99; fi\n'
        'as bash -c "$RUN" >"$PLACE/run" 2>&1 || true\n'
        'as "$PYTHON" -m roboirg doctor >"$PLACE/doctor" 2>&1 || true\n'
    )
    subprocess.run(  # noqa: S603 - the commands above
        ["/usr/bin/unshare", "--mount", "bash", "-c", script],
        env=os.environ | {name: str(value) for name, value in variables.items()},
        check=True,
        timeout=TIMEOUT_S,
    )
    found = (place / "run").read_text("utf-8", "replace")
    doctor = (place / "doctor").read_text("utf-8", "replace").replace(str(place), "…")
    return outcome_of(place / "out" / "records.jsonl", found), doctor.splitlines()


def outcome_of(records: Path, printed: str) -> str:
    """Return ``plays`` if all policies have an episode and the oracle's succeeded, else why not."""
    ends = {}
    if records.is_file():
        for line in records.read_text("utf-8").splitlines():
            record = json.loads(line)
            ends[record["policy"]] = record["outcome"]
    others = [ends.get(name, "error") != "error" for name in OTHERS]
    if ends.get("oracle") == "success" and all(others):
        return "plays"
    said = [line for line in printed.splitlines() if line.startswith("roboirg: ")]
    if said:
        return said[-1].removeprefix("roboirg: ")
    return f"{ends}: {printed[-300:]}"


def rows(machines: Sequence[Machine]) -> Iterator[tuple[str, str, str]]:
    """Play on each machine and yield its row of the table."""
    model = ThreadingHTTPServer(("127.0.0.1", 0), Answer)
    threading.Thread(target=model.serve_forever, daemon=True).start()
    usual: list[str] = []
    for machine in machines:
        with tempfile.TemporaryDirectory(prefix="roboirg-odd-") as parent:
            Path(parent).chmod(0o755)
            happened, lines = play(machine, model.server_port, Path(parent) / machine.place)
        usual = usual or lines
        named = []
        for line in lines:
            words = " ".join(line.split())
            if line not in usual and not words.startswith(("ok test", "->", "1 of", "2 of")):
                named.append(words)
        print(machine.name, happened, *lines, sep="\n", file=sys.stderr)
        yield machine.name, happened, "<br>".join(named) or "as usual"


if __name__ == "__main__":
    chosen = [machine for machine in MACHINES if machine.name in sys.argv[1:]]
    found = table(("machine", "a run", "`doctor`"), rows(chosen or MACHINES))
    print(found)
    if not chosen:
        page = PAGE.read_text(encoding="utf-8")
        PAGE.write_text(with_part(page, "odd machines", found), encoding="utf-8")
