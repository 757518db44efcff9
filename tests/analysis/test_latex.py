"""LaTeX tables fit the text of articles with one and with two columns, whatever they hold."""

from __future__ import annotations

import re
import shutil
import subprocess
from decimal import Decimal
from pathlib import Path

import pytest
from msgspec.structs import replace

from roboirg.evaluation.analysis.stats.cells import gather
from roboirg.evaluation.analysis.tables.paper_tables import WHICH, make_table
from roboirg.evaluation.analysis.tables.rendering.latex import MOST_LINES, latex
from roboirg.evaluation.analysis.tables.table import Column, Entry, Row, Table

DOCUMENT = r"""
\documentclass%s{article}
\usepackage[utf8]{inputenc}
\usepackage{booktabs}
\begin{document}
%s
\end{document}
"""
LONG = "my_package.policies:NetWithAVeryLongName, 600 steps, frames of the video none (privileged)"


def crowded(policies: int, tasks: int) -> Table:
    """A table of which every entry has all that an entry can have."""
    entry = Entry(Decimal("100.00"), change="down", best=True, marks="!…", differences=("split",))
    columns = [Column(f"MyVeryOwnTask{number}", f"Suite {number // 4}") for number in range(tasks)]
    return Table(
        key="crowded",
        title="Success & more",
        heads=("setting", "policy"),
        columns=(*columns, Column("Avg", averages=("MyVeryOwnTask0",))),
        rows=tuple(
            Row(setting, f"{LONG} {number}", "ours", (entry,) * (tasks + 1))
            for setting in ("explicit", "direct", "with_rival_and_more")
            for number in range(policies)
        ),
        notes=("Played from /a/very/long/path/" + "folder/" * 30 + ".",),
    )


def all_tables(like) -> list[Table]:
    cells = gather([("run", [*like("main"), *like("real"), *like("context")])])
    perfect = [replace(one, outcome="success") for one in like("main", "MemER")]
    return [
        make_table("main", gather([("run", perfect)]), published=True),
        *(make_table(one, cells, published=True) for one in WHICH if one != "other"),
        crowded(policies=2, tasks=7),
        crowded(policies=40, tasks=2),
    ]


def test_every_name_and_rate_is_there_once() -> None:
    table = crowded(policies=30, tasks=5)
    text = latex(table)
    plain = text.replace(r"\allowbreak{}", "").replace("\\_", "_")
    parts = text.count(r"\begin{table*}")
    assert parts > 4
    assert plain.count(r"\textbf{100.00}") == len(table.rows) * len(table.columns)
    for row in table.rows:
        assert plain.count(f"{row.label} &") == parts / len(blocks_of(text, table))
    assert len(set(re.findall(r"\\label\{(.*?)\}", text))) == parts
    assert text.count("folder") == 30  # the notes stand below the last one


def blocks_of(text: str, table: Table) -> set[str]:
    """The first names in each of the tables: one for each block of rows."""
    return {
        body.split(r"\raggedright ")[1].split(" & ")[0]
        for body in text.split(r"\begin{tabular}")[1:]
    }


def test_long_tables_are_divided_between_groups_if_that_is_possible() -> None:
    table = make_table("coverage", {})
    few, many = latex(table), latex(crowded(policies=MOST_LINES, tasks=1))
    assert few.count(r"\begin{table*}") == 1
    assert many.count(r"\begin{table*}") > 3


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no TeX: texlive-latex-recommended")
@pytest.mark.parametrize("layout", ["", "[twocolumn]"])
def test_no_box_is_overfull(tmp_path: Path, published_like, layout: str) -> None:
    tables = all_tables(published_like)
    text = "\n\\clearpage\n".join(latex(table) for table in tables)
    (tmp_path / "paper.tex").write_text(DOCUMENT % (layout, text), encoding="utf-8")
    subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"],
        cwd=tmp_path, check=True, capture_output=True,
    )  # fmt: skip
    log = (tmp_path / "paper.log").read_text(errors="replace")
    bad = [line for line in log.splitlines() if re.search(r"Overfull|too large|^!", line)]
    assert bad == []
    assert (tmp_path / "paper.pdf").stat().st_size > 10_000
