"""The licenses of what is exported, by Hugging Face's names; docs/licenses.md has the reasons."""

OWN_LICENSE = "apache-2.0"
"""Of code, words, states, actions, answers and results."""
PICTURE_LICENSE = "cc-by-nc-4.0"
"""Of pictures and videos of the simulation, and of weights trained on them."""
TERMS = (
    f"License of pictures and videos: `{PICTURE_LICENSE}`. RoboIRGBench's scenes are rendered "
    "with the robot and the table of [ManiSkill 3.0.1](https://github.com/haosulab/ManiSkill), "
    "whose assets are under [CC BY-NC 4.0](https://creativecommons.org/licenses/by-nc/4.0/) by its "
    f"own description. License of all else: `{OWN_LICENSE}`."
)
"""What the card of a dataset with pictures says of both; it has the credit that the first wants."""
