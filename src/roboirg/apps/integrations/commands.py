"""Command that makes records of other harnesses' results."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.records_commands import records_app
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.plain_text import counted

_SEED = "seed"
"""Field of an import, not of records."""


def import_results(
    harness: Annotated[str, typer.Argument(help="lerobot, vla-eval, inspect or jsonl.")],
    file: Annotated[
        Path,
        typer.Argument(
            help="eval_info.json, recording-ID.sqlite, a log as JSON, or a file with one episode "
            "per line."
        ),
    ],
    out: Annotated[Path, typer.Option(help="Folder for the records.")],
    policy: Annotated[str, typer.Option(help="Name of the policy in tables.")],
    set_: Annotated[
        list[str] | None,
        typer.Option(
            "--set",
            help="FIELD=VALUE for all records, such as max_steps=900; seed=VALUE is the seed of "
            "lerobot-eval (1000); repeatable.",
        ),
    ] = None,
) -> None:
    """Make records of the results of another harness, for tables, compare and report.

    Example: roboirg records import lerobot eval_info.json --policy mine --out runs/mine
    """
    from roboirg.apps.integrations.result_import import LEROBOT_SEED, ImportOptions
    from roboirg.apps.integrations.result_import import import_results as write_records

    fields = dict(map(_field, set_ or []))
    seed = fields.pop(_SEED, str(LEROBOT_SEED))
    if not seed.isdecimal():
        raise InvalidValueError(f"seed is {seed!r}; it must be a whole number from 0.")
    count = write_records(harness, file, out, ImportOptions(policy, int(seed), fields))
    typer.echo(f"{counted(count, 'record')} in {out}")


def _field(text: str) -> tuple[str, str]:
    from roboirg.core.instruction_options import OPTION_NAMES
    from roboirg.evaluation.records.record import IDENTITY

    name, sign, value = text.partition("=")
    if not sign:
        raise InvalidValueError(f"--set {text!r} has no value; write FIELD=VALUE.")
    known = (*IDENTITY, *OPTION_NAMES, _SEED)
    if name not in known:
        raise UnknownNameError("field", name, known)
    return name, value


def add_commands(app: typer.Typer) -> None:
    del app  # the group is part of it already
    records_app.command("import")(import_results)
