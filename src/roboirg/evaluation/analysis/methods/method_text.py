"""A methods section in Markdown, LaTeX or JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping, Sequence

from roboirg.evaluation.analysis.methods.method_sections import Section
from roboirg.evaluation.analysis.tables.rendering.latex import escaped as latex_escaped
from roboirg.evaluation.analysis.tables.rendering.markdown import escaped as markdown_escaped


def write_methods(sections: Sequence[Section], name: str) -> str:
    """Return the sections in one of `FORMATS`."""
    return FORMATS[name](sections)


def _markdown(sections: Sequence[Section]) -> str:
    lines = ["# Methods"]
    for section in sections:
        lines += ["", f"## {section.title}", ""]
        lines += [
            f"- **{markdown_escaped(one.label)}**: {markdown_escaped(one.text)}"
            for one in section.facts
        ]
    return "\n".join(lines) + "\n"


def _latex(sections: Sequence[Section]) -> str:
    lines = [r"\section{Methods}"]
    for section in sections:
        lines += [rf"\subsection{{{latex_escaped(section.title)}}}", r"\begin{description}"]
        lines += [
            rf"\item[{{{latex_escaped(one.label)}}}] {latex_escaped(one.text)}"
            for one in section.facts
        ]
        lines += [r"\end{description}"]
    return "\n".join(lines) + "\n"


def _json(sections: Sequence[Section]) -> str:
    content = {one.title: {fact.label: fact.text for fact in one.facts} for one in sections}
    return json.dumps(content, ensure_ascii=False, indent=2) + "\n"


FORMATS: Mapping[str, Callable[[Sequence[Section]], str]] = {
    "markdown": _markdown,
    "latex": _latex,
    "json": _json,
}
