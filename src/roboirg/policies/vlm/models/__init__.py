"""Models by provider, each through the provider's own client library."""

from __future__ import annotations

from roboirg.policies.vlm.models.model import Model, ModelOptions, ModelQuery, ModelReply

__all__ = ["Model", "ModelOptions", "ModelQuery", "ModelReply", "make_model"]


def make_model(options: ModelOptions) -> Model:
    """Return a connection to a model; nothing is sent before the first query."""
    if options.provider == "google":
        from roboirg.policies.vlm.models.google import GoogleModel

        return GoogleModel(options)
    from roboirg.policies.vlm.models.openai_compatible import OpenAIModel

    return OpenAIModel(options)
