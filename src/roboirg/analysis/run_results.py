"""The results of a run as a Python object: data frame, tables, figures, comparison, page."""

from __future__ import annotations

import functools
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboirg.analysis.figures import draw_figure
from roboirg.analysis.measures.comparison import compare
from roboirg.analysis.measures.comparison_text import sentences
from roboirg.analysis.measures.measure import ALL_TASKS
from roboirg.analysis.measures.run_data import RunData
from roboirg.analysis.results.frame import COLUMNS, MISSING
from roboirg.analysis.results.reading import read_frame, record_columns
from roboirg.analysis.results.sources import Source, opened_sources
from roboirg.analysis.tables.paper_tables import WHICH, is_informative, make_table
from roboirg.analysis.tables.rendering import get_format
from roboirg.analysis.tables.table_notes import with_mixtures
from roboirg.core.errors import InvalidValueError, check_names
from roboirg.core.extras import extra_needed
from roboirg.core.instruction_options import options_label
from roboirg.core.plain_text import counted
from roboirg.records.record import Record, Summary
from roboirg.records.run_files import run_folder
from roboirg.records.store import read_records
from roboirg.stats.rates import half_up

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
    played = frame.take(frame.is_played)
    series = {}
    for column in (*COLUMNS.values(), *record_columns().values()):
        values = pd.Series(played[column.name])
        series[column.name] = values.astype(_TYPES[column.kind])
    return pd.DataFrame(series)


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
        return list(self._data.frame["outcome"]).count("error")

    @property
    def missing(self) -> int:
        """Number of planned episodes that were not played."""
        return list(self._data.frame["outcome"]).count(MISSING)

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
        """Return the mean success over tasks, 0 to 1: ``{("pi0", "relational"): 0.42}``.

        The setting is followed by options that are not the default. If a policy was played under
        several conditions or in several versions, each has a label of its own.
        """
        data = self._data.without_control_arms
        rates = {}
        for key, summary in data.summaries.items():
            if key.scope == ALL_TASKS and summary.rate is not None:
                policy_run = key.policy_run
                policy = data.frame.names[policy_run].removesuffix(policy_run.mark)
                rates[policy, options_label(key.options)] = float(summary.rate)
        return rates

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
        table = make_table(which, self._data, published=published, floors=floors)
        (table_with_notes,) = with_mixtures([table], self._data.frame)
        return get_format(format).draw(table_with_notes)

    def plot(self, which: str = "gaps", *, published: bool = False) -> Plot:
        """Draw one of the figures: gaps, context or failures.

        Args:
            which: name of the figure.
            published: whether to add the paper's values, in gray.

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
        frame = self._data.frame
        comparison = compare(frame.where(policy=first), frame.where(policy=second))
        first_label = comparison.first.marked_policy
        second_label = comparison.second.marked_policy
        return "\n".join(sentences(comparison, first_label, second_label))

    def report(self, *, videos: bool = True) -> Path:
        """Write the page of the run and return its path.

        Raises:
            MissingDependencyError: Jinja is not installed.
        """
        from roboirg.analysis.page.report import write_report

        return write_report(self._source, videos=videos)

    def __repr__(self) -> str:
        counts = f"{counted(self.errors, 'error')}, {self.missing:,} missing"
        episodes = counted(len(self.summaries), "episode")
        lines = [f"Results of {episodes} ({counts}) in {self.folder}"]
        for (policy, setting), rate in self.rates().items():
            lines.append(f"  {policy} {setting}: {half_up(100 * rate, 1)} %")
        return "\n".join(lines)

    def _repr_markdown_(self) -> str:
        for which in WHICH:
            if is_informative(which, self._data):
                return self.table(which, "markdown")
        return repr(self)

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
