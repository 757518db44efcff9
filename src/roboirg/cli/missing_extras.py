"""Say which extra a command needs, if one of its libraries is not installed."""

from __future__ import annotations

from collections.abc import Mapping

from roboirg.core.extras import install_command

_MODULES: Mapping[str, tuple[str, ...]] = {
    "sim": ("sapien", "gymnasium", "toppra", "av", "cv2", "zstandard"),
    "light": ("fast_simplification",),
    "pages": ("starlette", "uvicorn"),
    "report": ("jinja2", "markupsafe", "matplotlib", "sklearn", "scipy"),
    "export": ("pyarrow",),
    "demonstrations": ("h5py",),
    "learn": ("torch",),
    "ray": ("ray",),
    "remote": ("websockets", "msgpack", "httpx"),
    "tokens": ("sentencepiece", "tokenizers"),
    "vlm": ("openai", "google"),
}
"""Modules that each extra brings. Where two bring one, the extra with which it is mostly used."""


def describe_missing(error: ModuleNotFoundError) -> str | None:
    """Return one sentence that names the extra with the missing module; None if none has it."""
    module = (error.name or "").partition(".")[0]
    for extra, modules in _MODULES.items():
        if module in modules:
            return (
                f"This command needs the package {module!r}, which is not installed; "
                f"run: {install_command(extra)}"
            )
    return None
