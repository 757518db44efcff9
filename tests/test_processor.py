"""How many cores a command uses."""

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
def test_a_container_counts_the_cores_that_it_may_use_and_not_those_of_its_host(
    limits, cores, tmp_path, monkeypatch
):
    """The host has 8. Linux notes microseconds of processor time and a period: 200000 100000 is 2.

    Would find a worker for each core of the host, which runs out of memory.
    """
    for name, text in limits.items():
        (tmp_path / name).write_text(f"{text}\n")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(processor, "_CPU_QUOTAS", (("max",), ("quota", "period")))
    monkeypatch.setattr("os.sched_getaffinity", lambda _process: set(range(8)))

    assert processor.core_count() == cores


@pytest.mark.parametrize(
    ("cores", "advice"),
    [
        (8, "one per core"),
        (9, "one per core, or about 8 per GPU that renders if the policy wants every picture"),
    ],
)
def test_more_than_8_cores_come_with_the_advice_of_8_workers_for_a_gpu(cores, advice, monkeypatch):
    """The count of cores is replaced. On the GPU that was measured, sixteen workers were slower
    than eight."""
    monkeypatch.setattr(processor, "core_count", lambda: cores)

    assert processor.worker_advice() == advice
