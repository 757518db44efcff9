"""Lets torchvision be imported where its operators cannot be loaded; import this before LeRobot.

Its wheels need CUDA's libraries, PyTorch's for the CPU bring none. LeRobot imports torchvision
and, for what is tested here, uses none of its operators.
"""

import importlib.util
from pathlib import Path

import torch

_found = importlib.util.find_spec("torchvision")
if _found is not None:
    try:
        torch.ops.load_library(Path(_found.origin).with_name("_C.so"))
    except OSError:
        for _name in ("nms", "qnms"):
            torch.library.define(
                f"torchvision::{_name}", "(Tensor boxes, Tensor scores, float limit) -> Tensor"
            )
