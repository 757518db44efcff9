"""Made-up results with the rates of published tables."""

from __future__ import annotations

import functools
from collections.abc import Iterable
from fractions import Fraction

import numpy as np
from flat_jobs import make_result

from roboirg.analysis.published import TRIALS, published_rows
from roboirg.core.instruction_options import InstructionOptions
from roboirg.records.record import Summary


def with_rate(
    successes: int,
    episodes: int,
    seeds: int,
    rng: np.random.Generator,
    options: InstructionOptions,
    **fields: object,
) -> Iterable[Summary]:
    """Yield the results of a cell with a number of successes on randomly drawn trials."""
    won = np.zeros(episodes * seeds, dtype=bool)
    won[rng.permutation(len(won))[:successes]] = True
    for number, success in enumerate(won.tolist()):
        yield make_result(
            "success" if success else "failure",
            number // seeds,
            policy_seed=number % seeds,
            options=options,
            **fields,
        )


@functools.cache
def like_published(table: str, only: str | None = None) -> list[Summary]:
    """Return results with the rates, episodes and seeds of a published table."""
    episodes, seeds = TRIALS[table]  # type: ignore[index]
    rng = np.random.default_rng(8)
    return [
        result
        for row in published_rows(table)
        if only is None or row.model == only
        for task, rate in row.rates.items()
        if rate is not None
        for result in with_rate(
            round(Fraction(rate) * episodes * seeds / 100),
            episodes,
            seeds,
            rng,
            row.options,
            policy=row.model,
            task=task,
        )
    ]
