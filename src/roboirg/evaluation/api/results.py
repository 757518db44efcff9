"""The results of a run as a Python object: data frame, tables, figures, comparison, page."""

from __future__ import annotations

import functools
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.extras import extra_needed
from roboirg.core.plain_text import counted
from roboirg.evaluation.analysis.figures import draw_figure
from roboirg.evaluation.analysis.results.frame import COLUMNS, MISSING
from roboirg.evaluation.analysis.results.option_labels import options_label
from roboirg.evaluation.analysis.results.reading import WORD_COLUMNS, read_frame
from roboirg.evaluation.analysis.stats.comparison import compare
from roboirg.evaluation.analysis.stats.comparison_text import sentences
from roboirg.evaluation.analysis.stats.measure import ALL_TASKS
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.tables.paper_tables import WHICH, is_informative, make_table
from roboirg.evaluation.analysis.tables.rendering import get_format
from roboirg.evaluation.analysis.tables.table_notes import with_mixtures
from roboirg.evaluation.plan.sources import Source, opened_sources
from roboirg.evaluation.records.record import Record, Summary
from roboirg.evaluation.records.run_files import run_folder
from roboirg.evaluation.records.store import read_records

if TYPE_CHECKING:
    import pandas as pd
    from matplotlib.figure import Figure

_TYPES = {
    "text": "string",
    "texts": "object",
    "number": "Int64",
    "decimal": "Float64",
    "flag": "boolean",
}
"""Types of pandas, all of which know missing values, by the kind of a column."""


def results(*paths: str | Path) -> pd.DataFrame:
    """Return the results of runs as a data frame of pandas, a row for each episode.

    The page "Your own table" lists its columns.

    Args:
        paths: folders of runs, packs (``*.roboirg.zip``), or one policy of them, ``PATH:NAME``.

    Raises:
        StoreError: there are no records at a path.
        MissingDependencyError: pandas is not installed.
    """
    with extra_needed("A data frame needs pandas", "export"):
        import pandas as pd
    with opened_sources(paths) as sources:
        frame = read_frame(sources, words=True)
    played = frame.take(frame["outcome"] != MISSING)
    found = {
        one.name: pd.Series(played[one.name]).astype(_TYPES[one.kind])
        for one in (*COLUMNS.values(), *WORD_COLUMNS.values())
    }
    return pd.DataFrame(found)


@dataclass(frozen=True)
class Results:
    """What a run yielded. Notebooks show its main table, or that of all tasks it has.

    Attributes:
        folder: of the run, with ``records.jsonl``, which may be given as a text; `roboirg`
            commands take it, too.
    """

    folder: Path

    def __post_init__(self) -> None:
        object.__setattr__(self, "folder", run_folder(self.folder))

    @property
    def errors(self) -> int:
        """Number of episodes that ended in an error and are in no rate."""
        return [*self._data.frame["outcome"]].count("error")

    @property
    def missing(self) -> int:
        """Number of planned episodes that were not played."""
        return [*self._data.frame["outcome"]].count(MISSING)

    @functools.cached_property
    def summaries(self) -> tuple[Summary, ...]:
        """The verdicts, one for each episode, without instructions and events."""
        return self._source.results

    @functools.cached_property
    def records(self) -> tuple[Record, ...]:
        """The whole records, with instructions, events, times and metadata."""
        return read_records(self.folder)

    @property
    def frame(self) -> pd.DataFrame:
        """The results as `roboirg.results` returns them."""
        return results(self.folder)

    def rates(self) -> dict[tuple[str, str], float]:
        """Return the mean success over tasks, 0 to 1, by policy and setting (with options).

        Runs of a policy under several conditions or in several versions have labels of their own.
        """
        data = self._data.told
        names = data.frame.names
        return {
            (
                names[key.policy_run].removesuffix(key.policy_run.mark),
                options_label(key.options),
            ): float(one.rate)
            for key, one in data.summaries.items()
            if key.scope == ALL_TASKS and one.rate is not None
        }

    def table(
        self,
        which: str = "main",
        format: str = "terminal",  # noqa: A002
        *,
        published: bool = False,
        floors: Sequence[str] = (),
    ) -> str:
        """Return a table of the paper as text.

        Args:
            which: main, planner, context, real, other or coverage.
            format: terminal, markdown, latex or csv.
            published: whether to add the paper's rows.
            floors: expected successes to add: ``chance`` or names of shortcuts.

        Raises:
            UnknownNameError: there is no such table or format.
        """
        made = make_table(which, self._data, published=published, floors=floors)
        (noted,) = with_mixtures([made], self._data.frame)
        return get_format(format).draw(noted)

    def plot(self, which: str = "gaps", *, published: bool = False) -> Plot:
        """Return one of the figures: gaps, context or failures.

        Raises:
            UnknownNameError: there is no such figure.
            InvalidValueError: the run has nothing to draw for it.
            MissingDependencyError: matplotlib is not installed.
        """
        figure = draw_figure(which, self._data, published=published)
        if figure is None:
            raise InvalidValueError(f"The run has nothing to draw for {which!r}.")
        return Plot(figure)

    def compare(self, first: str, second: str) -> str:
        """Return the comparison of two policies on the same episodes, in sentences.

        Raises:
            UnknownNameError: the run has no such policy.
            InvalidValueError: the two cannot be compared.
        """
        names = list(dict.fromkeys(self._data.frame["policy"]))
        check_names(f"policy in {self.folder}", (first, second), names)
        ours, theirs = (self._data.frame.where(policy=one) for one in (first, second))
        found = compare(ours, theirs)
        marked = found.first.marked_policy, found.second.marked_policy
        return "\n".join(sentences(found, *marked))

    def report(self, *, videos: bool = True) -> Path:
        """Write the page of the run and return its path.

        Raises:
            MissingDependencyError: Jinja is not installed.
        """
        from roboirg.evaluation.analysis.page.report import write_report

        return write_report(self._source, videos=videos)

    def __repr__(self) -> str:
        counts = f"{counted(self.errors, 'error')}, {self.missing:,} missing"
        lines = [
            f"Results of {counted(len(self.summaries), 'episode')} ({counts}) in {self.folder}"
        ]
        lines += [f"  {policy} {name}: {100 * rate:.1f} %"
                  for (policy, name), rate in self.rates().items()]  # fmt: skip
        return "\n".join(lines)

    def _repr_markdown_(self) -> str:
        shown = [one for one in WHICH if is_informative(one, self._data)]
        return "\n".join(self.table(one, "markdown") for one in shown[:1]) or repr(self)

    @functools.cached_property
    def _source(self) -> Source:
        return Source(self.folder)

    @functools.cached_property
    def _data(self) -> RunData:
        return RunData(read_frame([self._source]))


@dataclass(frozen=True)
class Plot:
    """A figure that notebooks show.

    Attributes:
        figure: matplotlib's.
    """

    figure: Figure

    def save(self, path: str | Path, **options: Any) -> None:  # noqa: ANN401 - matplotlib's
        """Write it to a file; options as of ``Figure.savefig``."""
        self.figure.savefig(path, **options)

    def _repr_png_(self) -> bytes:
        file = io.BytesIO()
        self.figure.savefig(file, format="png", dpi=150)
        return file.getvalue()
