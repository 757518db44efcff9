"""A stand-in for RoboMME's file of sentences: the same interface, our own sentences."""

NUMBERS = ["zero", "one", "two", "three", "four", "five"]
ORDINALS = ["zeroth", "first", "second", "third", "fourth", "fifth"]


def get_language_goal(self, env):
    """Return the sentences for an environment; the first one counts."""
    return [SENTENCES[env](self), "a sentence that is never used"]


def bin_fill(self):
    world = self.env.unwrapped
    parts = []
    for color in ("red", "blue", "green"):
        count = getattr(world, f"{color}_cubes_target_number")
        if count:
            parts.append(f"{NUMBERS[count]} {color} cube{'s' if count > 1 else ''}")
    items = parts[0] if len(parts) == 1 else ", ".join(parts[:-1]) + " and " + parts[-1]
    return f"drop {items} into the bin, then press the button to stop"


def pick_x_times(self):
    world = self.env.unwrapped
    color = world.target_color_name
    count = world.num_repeats
    if count == 1:
        return f"grab the {color} cube and set it on the target, then press the button to stop"
    return (
        f"grab the {color} cube and set it on the target, repeating this action "
        f"{NUMBERS[count]} times, then press the button to stop"
    )


def swing_x_times(self):
    world = self.env.unwrapped
    color = world.target_color_name
    count = world.num_repeats
    again = "" if count == 1 else f", doing this {NUMBERS[count]} times"
    return (
        f"grab the {color} cube, swing it from above the right-side target to above the left-side "
        f"target{again}, then lower it to the table and press the button"
    )


def stop_cube(self):
    visit = ORDINALS[self.env.unwrapped.stop_time]
    return f"press the button so that the cube stops on the target when it arrives the {visit} time"


def picks(self, count, start):
    colors = self.env.unwrapped.color_names
    first = f"{start} pick up the container that hides the {colors[0]} cube"
    if count == 1:
        return first
    return f"{first}, put it down, and then pick up the container that hides the {colors[1]} cube"


def by_difficulty(start):
    def say(self):
        return picks(self, self.env.unwrapped.configs[self.difficulty]["pick"], start)

    return say


def by_picks(start):
    return lambda self: picks(self, self.pick_times, start)


def video_repick(self):
    cube = "watch the video, then lift and put down the same cube that was picked up there"
    if self.num_repeats == 1:
        return f"{cube}, and press the button to stop"
    return f"{cube}, {NUMBERS[self.num_repeats]} times in all, and press the button to stop"


def video_place_button(self):
    return (
        f"watch the video, then take the {self.target_color_name} cube and put it on the target "
        f"where a cube was placed right {self.target_target_language} the button was pressed"
    )


def video_place_order(self):
    return (
        f"watch the video, then take the {self.target_color_name} cube and put it on the target "
        f"where a cube was placed the {ORDINALS[self.which_in_subset]} time"
    )


SENTENCES = {
    "BinFill": bin_fill,
    "PickXtimes": pick_x_times,
    "SwingXtimes": swing_x_times,
    "StopCube": stop_cube,
    "VideoUnmask": by_difficulty("watch the video, then"),
    "ButtonUnmask": by_difficulty("press the button first, then"),
    "VideoUnmaskSwap": by_picks("watch the video with the swaps, then"),
    "ButtonUnmaskSwap": by_picks("press both buttons on the table first, then"),
    "VideoRepick": video_repick,
    "VideoPlaceButton": video_place_button,
    "VideoPlaceOrder": video_place_order,
}
