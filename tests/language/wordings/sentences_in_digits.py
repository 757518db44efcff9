"""A stand-in for RoboMME's file of sentences in another style: digits, adverbs, other nouns."""

ORDINALS = ["0th", "1st", "2nd", "3rd", "4th", "5th"]
TIMES = ["", "once", "twice", "3 times", "4 times", "5 times"]


def get_language_goal(self, env):
    """Return the sentences for an environment; the first one counts."""
    return [SENTENCES[env](self)]


def bin_fill(self):
    world = self.env.unwrapped
    counts = {
        "green": world.green_cubes_target_number,
        "blue": world.blue_cubes_target_number,
        "red": world.red_cubes_target_number,
    }
    items = " and ".join(f"{count} {color} cubes" for color, count in counts.items() if count)
    return f"Put {items} into the bin and finally press the button"


def pick_x_times(self):
    world = self.env.unwrapped
    return (
        f"Place the {world.target_color_name} cube onto the target {TIMES[world.num_repeats]} "
        "and finally press the button"
    )


def swing_x_times(self):
    world = self.env.unwrapped
    return (
        f"Move the {world.target_color_name} block back and forth between both targets "
        f"{TIMES[world.num_repeats]}, set it down and press the button to finish"
    )


def stop_cube(self):
    visit = ORDINALS[self.env.unwrapped.stop_time]
    return f"Use the button to stop the cube exactly as it reaches the target for the {visit} time"


def picks(self, count):
    first, second, _ = self.env.unwrapped.color_names
    lift = f"Lift the container hiding the {first} cube"
    return lift if count == 1 else f"{lift} and then the container hiding the {second} cube"


def video_repick(self):
    if self.num_repeats == 1:
        return "Pick up the cube that was picked up in the video again, then press the button"
    return (
        "Repeatedly pick up and put back down the cube that was picked up in the video "
        f"for {self.num_repeats} times, then press the button"
    )


def video_place_button(self):
    return (
        f"After watching the video, place the {self.target_color_name} cube on the target "
        f"immediately {self.target_target_language} the button was pressed."
    )


def video_place_order(self):
    return (
        f"After watching the video, place the {self.target_color_name} cube on the "
        f"{ORDINALS[self.which_in_subset]} target it was placed on."
    )


def by_difficulty(self):
    return picks(self, self.env.unwrapped.configs[self.difficulty]["pick"])


def by_picks(self):
    return picks(self, self.pick_times)


SENTENCES = {
    "BinFill": bin_fill,
    "PickXtimes": pick_x_times,
    "SwingXtimes": swing_x_times,
    "StopCube": stop_cube,
    "VideoUnmask": by_difficulty,
    "ButtonUnmask": by_difficulty,
    "VideoUnmaskSwap": by_picks,
    "ButtonUnmaskSwap": by_picks,
    "VideoRepick": video_repick,
    "VideoPlaceButton": video_place_button,
    "VideoPlaceOrder": video_place_order,
}
