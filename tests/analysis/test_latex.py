"""LaTeX tables fit any article, whatever they hold."""

from __future__ import annotations

import csv
import re
import shutil
import subprocess
from decimal import Decimal
from importlib import resources
from pathlib import Path

import pytest
from msgspec.structs import replace

from roboirg.evaluation.analysis.stats.cells import gather
from roboirg.evaluation.analysis.tables.paper_tables import WHICH, make_table
from roboirg.evaluation.analysis.tables.rendering.latex import latex
from roboirg.evaluation.analysis.tables.table import Column, Entry, Row, Table

DOCUMENT = r"""
\documentclass%s
\usepackage[utf8]{inputenc}
\usepackage{booktabs,xcolor,amssymb,array,graphicx}
\begin{document}
%s
\end{document}
"""
FILES = {"real": "real_world"}
LONG = "my_package.policies:NetWithAVeryLongName, 600 steps, frames of the video none (privileged)"


def crowded(policies: int, tasks: int) -> Table:
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
            Row(setting, f"{LONG} {number}", (entry,) * (tasks + 1))
            for setting in ("explicit", "direct", "with_rival_and_more")
            for number in range(policies)
        ),
        notes=("Played from /a/very/long/path/" + "folder/" * 30 + ".",),
    )


FACTS = Table(
    key="facts",
    title="Facts of the run",
    heads=("of", "fact"),
    columns=(Column("value", is_text=True),),
    rows=(Row("the run", "tasks", [", ".join(f"MyVeryOwnTask{number}" for number in range(40))]),),
)


def all_tables(like) -> list[Table]:
    cells = gather([("run", [*like("main"), *like("real"), *like("context")])])
    perfect = [replace(one, outcome="success") for one in like("main", "MemER")]
    return [
        make_table("main", gather([("run", perfect)]), published=True),
        *(make_table(one, cells, published=True) for one in WHICH if one != "other"),
        crowded(policies=2, tasks=7),
        crowded(policies=40, tasks=2),
        FACTS,
    ]


def test_every_name_and_rate_is_there_once() -> None:
    """And the notes below the last of the tables."""
    table = crowded(policies=30, tasks=20)
    text = latex(table)
    plain = text.replace(r"\allowbreak{}", "").replace("\\_", "_")
    labels = re.findall(r"\\label\{(.*?)\}", text)
    assert len(set(labels)) == len(labels) > 3
    rate = r"\textbf{100.00}\roboirgdown{100.00}\textsuperscript{!\ldots{}$\neq$}"
    assert plain.count(rate) == len(table.rows) * len(table.columns)
    names = [plain.count(f"\n{row.name} &") for row in table.rows]
    assert set(names) == {9}  # in three settings, and the columns in three parts
    assert text.count("folder") == 30
    assert text.rindex(r"\bottomrule") < text.index("folder")


ARROWS = {"up": 1, "down": -1, "same": 0}
REFERENCES = {"main": "explicit", "planner": "explicit", "real": "explicit", "context": "1,5"}


def shown(cell: str) -> tuple[str, float | None]:
    """The rate of a cell as printed, and its change with its sign."""
    rate, arrow, size = re.fullmatch(
        r"\s*(?:\\textbf\{)?([\d.]+|--)\}?(?:\\roboirg(\w+)\{([\d.]+)\})?\s*(?:\\\\)?", cell
    ).groups()
    return rate, None if arrow is None else ARROWS[arrow] * float(size)


def printed(which: str) -> dict[tuple[str, str, str], str]:
    """The published rates by model, setting or stages, and task, read without the package."""
    file = FILES.get(which, which)
    folder = resources.files("roboirg.evaluation.analysis") / "published_results"
    lines = csv.DictReader((folder / f"{file}.csv").read_text().splitlines())
    return {
        (
            line.get("model") or line["planner"],
            line.get("stages") or line["setting"],
            line["task"],
        ): line["success_rate_percent"]
        for line in lines
    }


@pytest.mark.parametrize("which", REFERENCES)
def test_a_published_table_is_one_and_has_every_printed_figure(which: str) -> None:
    text = latex(make_table(which, {}, published=True))
    assert text.count(r"\begin{table*}") == 1
    rates = printed(which)
    tasks = list(dict.fromkeys(task for _, _, task in rates))
    body = text.split(r"\midrule", 1)[1].split(r"\bottomrule")[0]
    found, group = 0, ""
    for line in body.splitlines():
        if heading := re.search(r"\\emph\{(.*?)\}+ ", line):
            group = plain(heading[1])
        elif "&" in line:
            names, cells = line.split(" & ")[: -len(tasks)], line.split(" & ")[-len(tasks) :]
            if which == "context":
                name = ",".join(str(at) for at, one in enumerate(names, 1) if "check" in one)
            else:
                name = plain(names[0])
            model, row = (name, group) if which in ("main", "real") else (group, name)
            for task, cell in zip(tasks, cells, strict=True):
                assert shown(cell) == expected(rates, model, row, task, REFERENCES[which])
                found += 1
    assert found == len(rates)


def plain(text: str) -> str:
    return re.sub(r"\\textsuperscript\{.*|\\allowbreak\{\}", "", text)


def expected(rates, model: str, row: str, task: str, reference: str):
    """A rate and its change; that of an average is on equal tasks."""
    rate = rates[model, row, task]
    if not rate:
        return "--", None
    if row == reference:
        return f"{float(rate):.2f}", None
    before = rates[model, reference, task]
    if task == "Avg":
        has = [name for one, own, name in rates if (one, own) == (model, row) and name != "Avg"]
        same = [float(rates[model, reference, name]) for name in has if rates[model, row, name]]
        before = round(sum(same) / len(same) + 1e-9, 2)
    return f"{float(rate):.2f}", round(float(rate) - float(before), 2)


@pytest.mark.skipif(
    shutil.which("pdflatex") is None
    or subprocess.run(["kpsewhich", "IEEEtran.cls"], check=False, capture_output=True).returncode,
    reason="no TeX: texlive-fonts-recommended, texlive-publishers",
)
@pytest.mark.parametrize(
    "document", ["[conference]{IEEEtran}", "{article}", "[twocolumn]{article}"]
)
def test_no_box_is_overfull(tmp_path: Path, published_like, document: str) -> None:
    text = "\n\\clearpage\n".join(map(latex, all_tables(published_like)))
    (tmp_path / "paper.tex").write_text(DOCUMENT % (document, text), encoding="utf-8")
    subprocess.run(
        ["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "paper.tex"],
        cwd=tmp_path, check=True, capture_output=True,
    )  # fmt: skip
    log = (tmp_path / "paper.log").read_text(errors="replace")
    bad = [line for line in log.splitlines() if re.search(r"Overfull|too large|^!", line)]
    assert bad == []
    assert (tmp_path / "paper.pdf").stat().st_size > 10_000
