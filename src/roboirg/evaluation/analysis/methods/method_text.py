"""A methods section in Markdown, LaTeX or JSON."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping

from roboirg.evaluation.analysis.tables.rendering.latex import escaped as latex_escaped
from roboirg.evaluation.analysis.tables.rendering.markdown import escaped as markdown_escaped

Sections = Mapping[str, Mapping[str, str]]
"""By heading, what is known of each item."""


def _markdown(sections: Sections) -> str:
    lines = ["# Methods"]
    for title, facts in sections.items():
        lines += ["", f"## {title}", ""]
        lines += [f"- **{markdown_escaped(one)}**: {markdown_escaped(facts[one])}" for one in facts]
    return "\n".join(lines) + "\n"


def _latex(sections: Sections) -> str:
    lines = [r"\section{Methods}"]
    for title, facts in sections.items():
        lines += [rf"\subsection{{{latex_escaped(title)}}}", r"\begin{description}"]
        lines += [rf"\item[{{{latex_escaped(one)}}}] {latex_escaped(facts[one])}" for one in facts]
        lines += [r"\end{description}"]
    return "\n".join(lines) + "\n"


def _json(sections: Sections) -> str:
    return json.dumps(sections, ensure_ascii=False, indent=2) + "\n"


FORMATS: Mapping[str, Callable[[Sections], str]] = {
    "markdown": _markdown,
    "latex": _latex,
    "json": _json,
}
