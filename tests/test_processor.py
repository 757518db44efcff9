"""How many cores a command uses."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboirg.util import processor


@pytest.mark.parametrize(
    ("limits", "cores"),
    [
        ({}, 8),
        ({"max": "max 100000"}, 8),
        ({"max": "200000 100000"}, 2),
        ({"max": "50000 100000"}, 1),
        ({"max": "250000 100000"}, 3),
        ({"max": "3200000 100000"}, 8),
        ({"max": "100000 0"}, 8),
        ({"max": "1 inf"}, 1),
        ({"quota": "-1", "period": "100000"}, 8),
        ({"quota": "400000", "period": "100000"}, 4),
    ],
)
def test_a_container_has_the_cores_of_its_limit(
    limits: dict[str, str], cores: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Otherwise it starts a worker for each core of its host, and runs out of memory."""
    for name, text in limits.items():
        (tmp_path / name).write_text(f"{text}\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(processor, "_CPU_QUOTAS", (("max",), ("quota", "period")))
    monkeypatch.setattr("os.sched_getaffinity", lambda _process: set(range(8)))
    assert processor.core_count() == cores
