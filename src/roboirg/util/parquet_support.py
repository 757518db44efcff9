"""Whether Parquet files can be written."""

from __future__ import annotations

from roboirg.core.errors import MissingDependencyError


def check_parquet_support() -> None:
    """Check early that Parquet files can be written.

    Raises:
        MissingDependencyError: pyarrow is not installed.
    """
    try:
        import pyarrow.parquet  # noqa: F401 - an extra
    except ImportError as error:
        raise MissingDependencyError(
            "Parquet files need pyarrow; run: pip install 'roboirgbench[export]'."
        ) from error
