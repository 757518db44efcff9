import pytest
import synthetic_trajectories

from roboirg.apps.demonstrations import export_run
from roboirg.apps.demonstrations.export_plan import ExportPlan


@pytest.fixture
def synthetic(monkeypatch):
    """Record synthetic trajectories instead of playing episodes."""
    monkeypatch.setattr(export_run, "record_trajectory", synthetic_trajectories.record)
    monkeypatch.setattr(export_run, "choose_policy", lambda job: None)


@pytest.fixture
def make_plan():
    def make(**changes):
        values = {
            "tasks": ("PickXtimes", "VideoUnmask"),
            "split": "train",
            "episodes": (0, 1, 2),
            "settings": ("explicit", "direct"),
            **changes,
        }
        return ExportPlan(**values).validated()

    return make


@pytest.fixture
def export(synthetic, tmp_path, make_plan):
    """Export a plan of synthetic trajectories; returns the folder."""

    def run(name="data", **changes):
        out = tmp_path / name
        export_run.run_export(make_plan(**changes), out, 0, lambda *_: None)
        return out

    return run
