"""Lets torchvision be imported where its operators cannot be loaded; import this before LeRobot.

Some of its wheels need CUDA's libraries, and PyTorch's for the CPU bring none. LeRobot imports
torchvision and, for what is tested here, uses none of its operators.
"""

import importlib

import torch

try:
    importlib.import_module("torchvision")
except RuntimeError:
    for _name in ("nms", "qnms"):
        torch.library.define(
            f"torchvision::{_name}", "(Tensor boxes, Tensor scores, float limit) -> Tensor"
        )
    importlib.import_module("torchvision")
