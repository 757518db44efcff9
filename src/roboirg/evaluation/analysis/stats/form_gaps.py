"""Gaps between the implicit and the resolved form, by suite and setting."""

from __future__ import annotations

from typing import NamedTuple

from roboirg.core.instruction_options import InstructionOptions
from roboirg.evaluation.analysis.stats.cells import PolicyRun
from roboirg.evaluation.analysis.stats.option_labels import default_settings
from roboirg.evaluation.analysis.stats.paired_tests import Gap
from roboirg.evaluation.analysis.stats.run_data import RunData
from roboirg.evaluation.analysis.stats.run_summary import ALL, ALL_TASKS, Scope, ScopeKey


class FormRow(NamedTuple):
    """Scope, setting and the gap between the two forms."""

    scope: str
    setting: str
    gap: Gap


def form_rows(data: RunData, policy_run: PolicyRun) -> list[FormRow]:
    """Return the gaps of a policy run; with several suites those over all tasks come last."""
    suites = dict.fromkeys(key.scope.suite for key in data.summaries if key.scope.suite is not None)
    settings = default_settings(key.options for key in data.summaries)
    scopes = [(suite, Scope(suite=suite)) for suite in suites]
    if len(scopes) > 1:
        scopes.append((ALL_TASKS, ALL))
    return [
        FormRow(name, setting, one.form_gap)
        for name, scope in scopes
        for setting in settings
        if (key := ScopeKey(policy_run, scope, InstructionOptions(setting))) in data.summaries
        if (one := data.summaries[key]).form_gap is not None
    ]
