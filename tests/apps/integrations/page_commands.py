"""The commands of a page, run as they stand there but for named values."""

import importlib.metadata
import json
import os
import re
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent
ROOT = HERE.parents[2]
PAGE = "integrations.md"


def blocks(section, language, page=PAGE):
    """Return the contents of a section's blocks of code, or of all if it is None."""
    text = (ROOT / "docs" / page).read_text()
    if section is not None:
        text = text.split(f"\n## {section}\n")[1].split("\n## ")[0]
    return re.findall(rf"```{language}\n(.*?)```", text, flags=re.DOTALL)


def replaced(text, values):
    """Return a text with other values; each must be there."""
    for old, new in values.items():
        assert old in text, f"the page does not say {old!r}"
        text = text.replace(old, str(new))
    return text


def run_page(section, folder, values, page=PAGE, **variables):
    """Run what a section says after the installation.

    Args:
        section: its heading; None for the whole page, whose YAML is written to the file that its
            first line names.
        folder: where the commands run; `integrations` of this repository is there, too.
        values: what is said on the page, and what to say instead.
        page: its name.
        **variables: of the environment.
    """
    scripts = blocks(section, "sh", page)
    if section is None:
        for content in blocks(section, "yaml", page):
            first_line = content.partition("\n")[0]
            (folder / first_line.lstrip("# ")).write_text(content)
    else:
        scripts = [script for script in scripts if "pip install" in script]
        assert len(scripts) == 1
    commands = [line for line in _joined("".join(scripts)) if not is_installation(line)]
    (folder / "integrations").symlink_to(ROOT / "integrations")
    environment = os.environ | variables
    for name, first in (("PATH", Path(sys.executable).parent), ("PYTHONPATH", HERE)):
        environment[name] = os.pathsep.join(filter(None, [str(first), os.environ.get(name)]))
    done = subprocess.run(
        ["bash", "-ec", replaced("\n".join(commands), values)],
        capture_output=True, text=True, check=False, cwd=folder, env=environment,
    )  # fmt: skip
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr[-3000:]


def is_installation(line):
    """Whether a command makes an environment; the script that runs these tests did so."""
    return "venv" in line or line.startswith(("make setup", "pip install"))


def read_verdicts(folder):
    """Return what a program of the page wrote of each episode."""
    return [json.loads(line) for line in (folder / "verdicts.jsonl").read_text().splitlines()]


def check_versions(section, page=PAGE):
    """Fail unless the versions that the page pins are those that are installed."""
    scripts = "".join(blocks(section, "sh", page))
    pinned = re.findall(r"([\w-]+)(?:\[[\w,-]+\])?==([\w.]+)", scripts)
    assert pinned
    for name, version in pinned:
        assert importlib.metadata.version(name) == version, name


def _joined(script):
    return script.replace("\\\n", " ").splitlines()
