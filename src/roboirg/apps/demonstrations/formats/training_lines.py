"""Ready lines for the trainers that read a dataset."""

from __future__ import annotations

from pathlib import Path

from roboirg.apps.demonstrations.export_plan import ExportPlan

_LEROBOT = """\
```sh
# Needs the environment of docs/training.md, Install: Python 3.12 with LeRobot and roboirg.
lerobot-train --dataset.repo_id=local/roboirg --dataset.root={root}{backend} \\
    --policy.type=act --policy.push_to_hub=false --policy.device=cuda \\
    --policy.pretrained_backbone_weights=null --dataset.use_imagenet_stats=false \\
    --batch_size=64 --steps=20000 --wandb.enable=false --output_dir=outputs/act
{after}```

The same line with `--policy.type=diffusion` trains Diffusion Policy, and with `--policy.type=vqbet`
VQ-BeT, which takes one camera. None of the three reads the instruction: train them on one task at a
time. With `null`, they begin without the weights of ImageNet, and nothing is downloaded.

Expect little of these lines: ACT, trained like this for three minutes (one H100, a narrower
network, 100 demonstrations of PickXtimes), solved 0 of 50 episodes of `val`. All 20,000 steps have
not been trained here. `roboirg learn policy --tasks PickXtimes`, with 400 scenes, made a policy
that solves 95 % of the same episodes.
"""
_LEROBOT_RUN = """\
roboirg run --policy 'act=lerobot://outputs/act/checkpoints/last/pretrained_model?device=cuda' \\
    --tasks {task} --out runs/act
"""
_WAYPOINTS = """\
# lerobot:// plays joint angles alone. To play a policy of waypoints, write a class with
# actions = "waypoint", and round its gripper to -1, 0 or 1.
"""
_PYAV = " --dataset.video_backend=pyav"
"""Of a dataset with videos; LeRobot's usual decoder, torchcodec, needs FFmpeg on the system."""

_OPENPI = """\
openpi reads this dataset with the LeRobot that it pins. Save the following as
`roboirg_config.py` next to openpi's `scripts/`, and start training through it:

```python
import dataclasses
import pathlib
import runpy
import sys

import openpi.models.pi0_config as pi0_config
import openpi.policies.libero_policy as libero_policy
import openpi.training.config as configs
import openpi.training.optimizer as optimizer
import openpi.training.weight_loaders as weight_loaders
import openpi.transforms as transforms


@dataclasses.dataclass(frozen=True)
class RoboIRGData(configs.DataConfigFactory):
    def create(self, assets_dirs: pathlib.Path, model_config):
        repack = transforms.Group(inputs=[transforms.RepackTransform({{
            "observation/image": "{front}", "observation/wrist_image": "{wrist}",
            "observation/state": "{state}", "actions": "{action}", "prompt": "prompt"}})])
        data = transforms.Group(
            inputs=[libero_policy.LiberoInputs(model_type=model_config.model_type)],
            outputs=[FirstEight()])
        mask = transforms.make_bool_mask(7, -1)
        data = data.push(inputs=[transforms.DeltaActions(mask)],
                         outputs=[transforms.AbsoluteActions(mask)])
        return dataclasses.replace(
            self.create_base_config(assets_dirs, model_config), repack_transforms=repack,
            data_transforms=data,
            model_transforms=configs.ModelTransformFactory()(model_config),
            action_sequence_keys=("{action}",))


@dataclasses.dataclass(frozen=True)
class FirstEight(transforms.DataTransformFn):
    def __call__(self, data):
        return {{"actions": data["actions"][..., :8]}}


configs._CONFIGS_DICT["pi05_roboirg"] = configs.TrainConfig(
    name="pi05_roboirg",
    model=pi0_config.Pi0Config(pi05=True, action_horizon=20, max_token_len=160),
    data=RoboIRGData(repo_id="roboirg", base_config=configs.DataConfig(prompt_from_task=True)),
    weight_loader=weight_loaders.CheckpointWeightLoader(
        "gs://openpi-assets/checkpoints/pi05_base/params"),
    num_train_steps=80000, batch_size=64,
    lr_schedule=optimizer.CosineDecaySchedule(
        warmup_steps=10000, peak_lr=5e-05, decay_steps=80000,
        decay_lr=5e-05))
runpy.run_path(sys.argv.pop(1), run_name="__main__")
```

```sh
export HF_LEROBOT_HOME={parent}   # the folder above this one, which must be named `roboirg`
python roboirg_config.py scripts/compute_norm_stats.py --config-name pi05_roboirg
python roboirg_config.py scripts/train.py pi05_roboirg --exp-name first
```

The configuration follows the shape of openpi's own; it has not been run here, because openpi needs
a GPU and packages from git. """
_GROOT = """\
GR00T reads `meta/modality.json`; it needs videos, so export with `--pictures lossless-video` or
`lossy-video`.
"""

_MME_VLA = """\
```sh
python scripts/build_dataset.py --raw_data_path {root}
uv run scripts/train.py mme_vla_suite --exp-name=perceptual-framesamp-modul \\
    --dataset-path=data/robomme_preprocessed_data --model.use_history \\
    --model.history_config=perceptual-framesamp-modul.yaml \\
    --num-train-steps=80000 --batch-size=64 \\
    --lr-schedule.peak-lr=5e-05 --lr-schedule.decay-lr=5e-05 \\
    --lr-schedule.warmup-steps=10000
```

are MME-VLA's builder, which reads these files as RoboMME's own, and its training.
`waypoint_action` is all NaN, `choice_action` empty and `available_multi_choices` an empty list:
nothing here acts in these spaces. Recording ends with the success, so that no time step
`is_completed`.
"""


def training_text(plan: ExportPlan, root: Path) -> str:
    """Return what to do with a dataset, as Markdown.

    Args:
        plan: what is exported.
        root: folder of the dataset.
    """
    from roboirg.apps.demonstrations.frame_columns import FrameColumns

    place = root.resolve()
    if plan.format == "robomme-hdf5":
        return _MME_VLA.format(root=place)
    if plan.format == "lerobot-v2.1":
        if not plan.is_for_openpi:
            return _GROOT
        return _OPENPI.format(parent=place.parent, **FrameColumns(plan).keys) + _GROOT
    backend = _PYAV if FrameColumns(plan).has_videos else ""
    after = _WAYPOINTS if plan.actions == "waypoint" else _LEROBOT_RUN.format(task=plan.tasks[0])
    return _LEROBOT.format(root=place, after=after, backend=backend)
