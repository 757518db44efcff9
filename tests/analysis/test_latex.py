"""LaTeX tables fit any article, whatever they hold."""

from __future__ import annotations

import re
import shutil
import subprocess
from decimal import Decimal

import pytest
from flat_jobs import frame_of
from msgspec.structs import replace
from published_results import like_published

from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.tables.paper_tables import WHICH, make_table
from roboirg.analysis.tables.rendering.latex import latex
from roboirg.analysis.tables.table import Column, Entry, Row, Table

DOCUMENT = r"""
\documentclass%s
\usepackage[utf8]{inputenc}
\usepackage{booktabs,xcolor,amssymb,array,graphicx}
\begin{document}
%s
\end{document}
"""
LONG_POLICY_NAME = (
    "my_package.policies:NetWithAVeryLongName, 600 steps, frames of the video none (privileged)"
)


def table_with_full_entries(policies, tasks):
    """A table of which every entry has all that an entry can have."""
    entry = Entry(
        Decimal("100.00"), change=Decimal("-100.00"), best=True, marks="!…", differences=("split",)
    )
    columns = [Column(f"MyVeryOwnTask{number}", f"Suite {number // 4}") for number in range(tasks)]
    return Table(
        key="crowded",
        title="Success & more",
        heads=("setting", "policy"),
        columns=(*columns, Column("Avg", averages=("MyVeryOwnTask0",))),
        rows=tuple(
            Row(setting, f"{LONG_POLICY_NAME} {number}", (entry,) * (tasks + 1))
            for setting in ("explicit", "direct", "with_rival_and_more")
            for number in range(policies)
        ),
        notes=("Played from /a/very/long/path/" + "folder/" * 30 + ".",),
    )


TABLE_WITH_A_LONG_TEXT = Table(
    key="facts",
    title="Facts of the run",
    heads=("of", "fact"),
    columns=(Column("value", is_text=True),),
    rows=(Row("the run", "tasks", [", ".join(f"MyVeryOwnTask{number}" for number in range(40))]),),
)


@pytest.fixture(scope="module")
def latex_of_all_tables():
    """All tables, with results like the published ones and with perfect ones, and crowded ones."""
    like = like_published
    data = RunData(frame_of([*like("main"), *like("real"), *like("context")]))
    perfect = [replace(result, outcome="success") for result in like("main", "MemER")]
    tables = [
        make_table("main", RunData(frame_of(perfect)), published=True),
        *(make_table(which, data, published=True) for which in WHICH if which != "other"),
        table_with_full_entries(policies=2, tasks=7),
        table_with_full_entries(policies=40, tasks=2),
        TABLE_WITH_A_LONG_TEXT,
    ]
    return "\n\\clearpage\n".join(map(latex, tables))


def test_a_table_too_large_for_a_page_is_printed_in_parts_without_losing_a_rate():
    """30 policies in 3 settings are 90 rows; 20 tasks and their average are 21 columns.

    Every entry is the same: a rate of 100.00 that is best (bold), 100 points below explicit (down),
    with an error (!), missing trials (…) and another split than the paper's (≠).
    """
    table = table_with_full_entries(policies=30, tasks=20)

    text = latex(table)

    entry = r"\textbf{100.00}\roboirgdown{100.00}\textsuperscript{!\ldots{}$\neq$}"
    assert text.count(r"\begin{table*}") > 1
    assert text.count(entry) == 90 * 21


def test_each_part_of_a_table_in_latex_names_the_policies_of_its_rows():
    """A page takes 8 of the 21 columns, so a row is printed as 3 lines: of 8, 8 and 5 columns.

    A policy has a row in each of 3 settings. So 9 lines begin with its name, which is compared
    without the places that LaTeX may break it at.
    """
    table = table_with_full_entries(policies=30, tasks=20)

    text = latex(table).replace(r"\allowbreak{}", "").replace(r"\_", "_")

    for row in table.rows:
        assert text.count(f"\n{row.name} &") == 9


def test_the_parts_of_a_table_have_labels_of_their_own_and_the_notes_stand_below_the_last():
    """The only note is a path with 30 folders."""
    text = latex(table_with_full_entries(policies=30, tasks=20))

    labels = re.findall(r"\\label\{(.*?)\}", text)
    assert len(set(labels)) == len(labels) > 3
    assert text.count("folder") == 30
    assert text.rindex(r"\bottomrule") < text.index("folder")


@pytest.mark.skipif(
    shutil.which("pdflatex") is None
    or subprocess.run(["kpsewhich", "IEEEtran.cls"], check=False, capture_output=True).returncode,
    reason="no TeX: texlive-fonts-recommended, texlive-publishers",
)
@pytest.mark.parametrize(
    "document", ["[conference]{IEEEtran}", "{article}", "[twocolumn]{article}"]
)
def test_no_box_is_overfull(tmp_path, latex_of_all_tables, document):
    """All tables are set by pdflatex, in a wide and two narrow kinds of document.

    The log would name a box that is wider than its column, or an error (!). A paper of less than 10
    kB would be empty.
    """
    (tmp_path / "paper.tex").write_text(
        DOCUMENT % (document, latex_of_all_tables), encoding="utf-8"
    )
    subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"],
        cwd=tmp_path, check=True, capture_output=True,
    )  # fmt: skip
    log = (tmp_path / "paper.log").read_text(errors="replace")

    bad = [line for line in log.splitlines() if re.search(r"Overfull|too large|^!", line)]

    assert bad == []
    assert (tmp_path / "paper.pdf").stat().st_size > 10_000
