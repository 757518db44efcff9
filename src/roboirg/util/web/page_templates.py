"""Templates of pages, read from a package's folder ``templates``, and what all pages share."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboirg.core.extras import extra_needed

if TYPE_CHECKING:
    import jinja2

_SHARED = "roboirg.util.web"


def template_environment(package: str) -> jinja2.Environment:
    """Return the environment of a package's templates: all that is filled in is escaped.

    A style or script that the package lacks is the one that all pages share.
    """
    import jinja2

    return jinja2.Environment(
        loader=jinja2.ChoiceLoader([jinja2.PackageLoader(one) for one in (package, _SHARED)]),
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
