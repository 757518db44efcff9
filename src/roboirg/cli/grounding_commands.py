"""Commands of the grounding dataset: ``roboirg export grounding``, ``roboirg score grounding``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from roboirg.cli.options import (
    AnySplit,
    Distractor,
    Forms,
    Frame,
    Reasoning,
    Rival,
    Settings,
    Stages,
    Tasks,
    Wordings,
    Workers,
)
from roboirg.util.plurals import counted

# Heavy modules are imported inside the commands, so that --help is fast.


def export_grounding(
    out: Annotated[Path, typer.Option(help="Folder for the dataset; continued if interrupted.")],
    split: AnySplit = "test",
    tasks: Tasks = "all",
    settings: Settings = "all",
    forms: Forms = "implicit",
    episodes: Annotated[
        str | None,
        typer.Option(help="4 for the first four, or a list such as 0,3,5-9; all by default."),
    ] = None,
    variants: Annotated[
        bool, typer.Option(help="Add every combination of the options below.")
    ] = False,
    stages: Stages = "1-5",
    distractor: Distractor = "neutral",
    frame: Frame = "robot",
    rival: Rival = "none",
    reasoning: Reasoning = "plain",
    wordings: Wordings = None,
    frames: Annotated[int, typer.Option(min=1, help="Most frames of a video as pictures.")] = 16,
    frames_every: Annotated[
        int, typer.Option(min=1, help="Control steps between two frames of a video.")
    ] = 8,
    formats: Annotated[
        str, typer.Option(help="Tables beside the JSON lines: parquet, tsv, both, or none.")
    ] = "parquet,tsv",
    workers: Workers = None,
) -> None:
    """Export questions of grounding with pictures: Parquet, JSON lines, VLMEvalKit's TSV."""
    from roboirg.cli.language_commands import known_name, known_settings, known_tasks
    from roboirg.cli.progress_bar import progress_bar
    from roboirg.core.instruction_options import InstructionOptions
    from roboirg.episodes.splits import SIZES
    from roboirg.evaluation.executors.executor import core_count
    from roboirg.evaluation.grounding_set.dataset_export import (
        TABLE_FORMATS,
        EpisodeName,
        ExportRequest,
        export_grounding,
    )
    from roboirg.evaluation.plan_parsing import (
        parse_episodes,
        parse_names,
        parse_splits,
        parse_stages,
    )
    from roboirg.language import FORMS
    from roboirg.language.export import check_export_support
    from roboirg.language.wordings.wording_store import open_wordings

    tables = () if formats.strip().lower() == "none" else parse_names("format", formats)
    kinds = tuple(known_name("format", one, TABLE_FORMATS) for one in tables)
    if "parquet" in kinds:
        check_export_support("parquet")
    identity = open_wordings(wordings)
    request = ExportRequest(
        episodes=tuple(
            EpisodeName(task, one, index)
            for task in known_tasks(tasks, identity)
            for one in parse_splits(split)
            for index in (range(SIZES[one]) if episodes is None else parse_episodes(episodes, one))
        ),
        settings=known_settings(settings),
        forms=tuple(known_name("form", one, FORMS) for one in parse_names("form", forms)),
        options=InstructionOptions(
            stages=parse_stages(stages),
            distractor=distractor,
            frame=frame,
            wordings=identity,
            rival=rival,
            reasoning=reasoning,
        ),
        every_variant=variants,
        frames=frames,
        frames_every=frames_every,
        wordings=wordings,
        formats=kinds,
    )
    count = core_count() if workers is None else workers
    with progress_bar("episodes") as progress:
        facts = export_grounding(request, out, count, progress)
    typer.echo(
        f"{counted(facts.items, 'item')}, {counted(facts.pictures, 'picture')}, "
        f"{counted(facts.videos, 'video')}, {facts.size / 2**20:.1f} MiB: {out}\n"
        f"sha256 {facts.sha256}"
    )
