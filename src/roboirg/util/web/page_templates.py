"""Templates of pages, read from a package's folder ``templates``."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.core.extras import extra_needed

if TYPE_CHECKING:
    import jinja2


def template_environment(package: str) -> jinja2.Environment:
    """Return the environment of a package's templates: all that is filled in is escaped."""
    import jinja2

    return jinja2.Environment(
        loader=jinja2.PackageLoader(package),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )


def check_page_support(page: str) -> None:
    """Check early that a page can be made.

    Args:
        page: its name, for the message.
    """
    with extra_needed(f"{page} needs Jinja", "report"):
        import jinja2  # noqa: F401 - an extra
