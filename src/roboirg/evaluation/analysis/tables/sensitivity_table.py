"""Table of verdicts under other choices of the analysis."""

from __future__ import annotations

from roboirg.core.errors import InvalidValueError
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.sensitivity import families_of, try_choices
from roboirg.evaluation.analysis.tables.table import POLICY, Column, Entry, Row, Table

_NOTE = (
    "Whether success is lower or higher than in explicit on the same episodes, or the first rate "
    "of control arms than the second (open: the test does not decide), as tested everywhere, and "
    "whether that holds under the other choices that can change it, with the verdict where it does "
    "not. Within a choice, p-values are corrected over all differences to explicit of the policy, "
    "or over all contrasts of its arms. An episode is a scene, so that rollouts and tasks are the "
    "other units."
)


def make_sensitivity_table(data: RunData) -> Table:
    """Make the table of the gaps and the control arms of all policies.

    Raises:
        InvalidValueError: there is no verdict that another choice could change.
    """
    tested = [(of.policy, one) for of in families_of(data) for one in try_choices(of.contrasts)]
    if not any(one.others for _, one in tested):
        raise InvalidValueError(
            "No other choice can change the runs: they need explicit and another setting, or "
            "control arms, in several tasks or with several seeds."
        )
    return Table(
        key="sensitivity",
        title="Verdicts under other choices of the analysis",
        heads=(POLICY, "contrast"),
        columns=(Column("verdict"), Column("in other analyses")),
        rows=tuple(
            Row(name, one.label, "ours", (Entry(word=one.verdict), Entry(word=one.sentence)))
            for name, one in tested
        ),
        notes=(_NOTE,),
    )
