"""Hook of MkDocs: pages outside docs/ and the command line become pages of the site."""

import contextlib
import io
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import typer.main
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from roboirg.main import app
from roboirg.runs.plan.plan_fields import plan_options

ROOT = Path(__file__).parents[1]
COMMAND_LINE = "command-line.md"
"""A page made of the commands' own help."""
PAGES = {
    "README.md": "index.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changes.md",
    "src/roboirg/analysis/published_results/README.md": "published-results.md",
}
"""The site's name of each page outside docs/."""
LINK = re.compile(r"(\]\()([^)\s#]+)")
NOTEBOOK_LINK = re.compile(r'(href="(?!https?:)[^"#:]+)\.(?:md|ipynb)(?=["#])')


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages that lie outside docs/, and that of the command line."""
    files.append(File.generated(config, COMMAND_LINE, content="\n".join(command_lines())))
    for source, name in PAGES.items():
        files.append(File.generated(config, name, content=(ROOT / source).read_text()))
    return files


def command_lines() -> Iterator[str]:
    """Yield the lines of the reference of all commands, from their help."""
    yield "# Command line\n\nThe help of each command, as `roboirg COMMAND --help` prints it.\n"
    yield from _help_of(typer.main.get_command(app), "roboirg")
    yield "## Keys of a plan\n"
    yield "| key | meaning | default |\n| --- | --- | --- |"
    for option in plan_options():
        yield f"| `{option.name}` | {_cell(option.help)} | {_default(option)} |"


def _help_of(command: Any, name: str) -> Iterator[str]:  # noqa: ANN401
    if hasattr(command, "commands"):
        for below in sorted(command.commands):
            yield from _help_of(command.commands[below], f"{name} {below}")
        return
    with contextlib.redirect_stdout(io.StringIO()):  # some parameters complete their words here
        command.get_help(command.make_context(name, [], resilient_parsing=True))
    yield f"## {name}\n"
    words = _cell(command.help, newline="\n\n")
    yield re.sub(r"^Example: (.+)$", r"Example: `\1`", words, flags=re.MULTILINE) + "\n"
    yield "| argument or option | meaning | default |\n| --- | --- | --- |"
    for parameter in command.params:
        if parameter.name == "help" or getattr(parameter, "hidden", False):
            continue
        names = [*parameter.opts, *parameter.secondary_opts]
        if parameter.param_type_name == "argument":
            names = [parameter.name.upper()]
        marks = ", ".join(f"`{name}`" for name in names)
        default = "required" if parameter.required else _default(parameter)
        yield f"| {marks} | {_cell(parameter.help)} | {default} |"
    yield ""


def _default(parameter: Any) -> str:  # noqa: ANN401
    shown = getattr(parameter, "show_default", None)
    if isinstance(shown, str):
        return _cell(shown)
    value = parameter.default
    if value is True:
        return f"`{parameter.opts[0]}`"
    if callable(value) or value in (None, False, (), []):
        return ""
    return f"`{_cell(str(value))}`"


def _cell(text: str | None, newline: str = " ") -> str:
    """Return a help text for Markdown, without Rich's marks."""
    return re.sub(r"\s*\n\s*", newline, (text or "").strip()).replace("|", "\\|")


def on_page_markdown(markdown: str, page: object, **_: object) -> str:
    """Change links between files of the repository into links between pages of the site."""
    uri = page.file.src_uri  # type: ignore[attr-defined]
    sources = {name: source for source, name in PAGES.items()}
    folder = (ROOT / sources.get(uri, f"docs/{uri}")).parent

    def change(link: re.Match[str]) -> str:
        target = link.group(2)
        if "://" in target:
            return link.group(0)
        path = (folder / target).resolve().relative_to(ROOT).as_posix()
        name = PAGES.get(path, path.removeprefix("docs/"))
        return f"{link.group(1)}{'../' * uri.count('/')}{name}"

    return LINK.sub(change, markdown)


def on_post_page(output: str, page: object, **_: object) -> str:
    """Change the links of notebooks, which are HTML already, to the pages of the site."""
    if not page.file.src_uri.endswith(".ipynb"):  # type: ignore[attr-defined]
        return output
    return NOTEBOOK_LINK.sub(r"\1.html", output)
