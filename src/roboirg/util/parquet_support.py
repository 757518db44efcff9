"""Whether Parquet files can be written."""

from __future__ import annotations

from roboirg.core.extras import extra_needed


def check_parquet_support(extra: str = "export") -> None:
    """Check early that Parquet files can be written."""
    with extra_needed("Parquet files need pyarrow", extra):
        import pyarrow.parquet  # noqa: F401 - an extra
