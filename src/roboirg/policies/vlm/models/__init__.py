"""Models by provider: requests over HTTP, stored replies, limits."""

from __future__ import annotations

from roboirg.policies.vlm.models.model import Model, ModelOptions, ModelQuery, ModelReply

__all__ = ["Model", "ModelOptions", "ModelQuery", "ModelReply", "make_model"]


def make_model(options: ModelOptions) -> Model:
    """Return a connection to a model; nothing is sent before the first query."""
    from roboirg.policies.vlm.models.http_model import HttpModel

    return HttpModel(options)
