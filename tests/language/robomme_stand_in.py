"""A stand-in for RoboMME's file of sentences: the same interface, our own sentences."""

NUMBERS = ["zero", "one", "two", "three", "four", "five"]
ORDINALS = ["zeroth", "first", "second", "third", "fourth", "fifth"]


def get_language_goal(self, env):
    """Return the sentences for an environment; the first one counts."""
    return [SENTENCES[env](self), "a sentence that is never used"]


def bin_fill(self):
    world = self.env.unwrapped
    return (
        f"drop {world.red_cubes_target_number} red, {world.blue_cubes_target_number} blue and "
        f"{world.green_cubes_target_number} green cubes into the bin, then press the button to stop"
    )


def pick_x_times(self):
    world = self.env.unwrapped
    return (
        f"set the {world.target_color_name} cube on the target {NUMBERS[world.num_repeats]} times, "
        "then press the button to stop"
    )


def swing_x_times(self):
    world = self.env.unwrapped
    return (
        f"swing the {world.target_color_name} cube from the right-side to the left-side target "
        f"{NUMBERS[world.num_repeats]} times, then lower it to the table and press the button"
    )


def stop_cube(self):
    visit = ORDINALS[self.env.unwrapped.stop_time]
    return f"press the button so that the cube stops on the target when it arrives the {visit} time"


def picks(self, count, start):
    colors = " and then ".join(self.env.unwrapped.color_names[:count])
    return f"{start} pick up the containers that hide {colors}"


def by_difficulty(start):
    def say(self):
        return picks(self, self.env.unwrapped.configs[self.difficulty]["pick"], start)

    return say


def by_picks(start):
    return lambda self: picks(self, self.pick_times, start)


def video_repick(self):
    return (
        "watch the video, then lift and put down the same cube that was picked up there, "
        f"{NUMBERS[self.num_repeats]} times in all, and press the button to stop"
    )


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
