"""The replaying policy as a checkpoint of LeRobot; needs LeRobot."""

import torchvision_operators  # noqa: F401 - before LeRobot
from lerobot.configs.types import FeatureType, PolicyFeature
from lerobot.processor import (
    DeviceProcessorStep,
    PolicyProcessorPipeline,
    RenameObservationsProcessorStep,
)
from replay_policy.configuration_replay import ReplayConfig
from replay_policy.modeling_replay import ReplayPolicy

from roboirg.core.observations import PICTURE_SIZE


def save_checkpoint(folder, table):
    """Save a policy that repeats the actions of a table, as LeRobot saves policies."""
    picture = PolicyFeature(type=FeatureType.VISUAL, shape=(3, PICTURE_SIZE, PICTURE_SIZE))
    config = ReplayConfig(
        device="cpu",
        table=str(table),
        input_features={"observation.images.front": picture},
        output_features={"action": PolicyFeature(type=FeatureType.ACTION, shape=(8,))},
    )
    ReplayPolicy(config).save_pretrained(folder)
    steps = [RenameObservationsProcessorStep(), DeviceProcessorStep(device="cpu")]
    PolicyProcessorPipeline(steps=steps, name="policy_preprocessor").save_pretrained(folder)
    PolicyProcessorPipeline(steps=[], name="policy_postprocessor").save_pretrained(folder)
