"""Parts of policies that have learned nothing."""

import numpy as np
import torch

from roboirg.tasks.splits.splits import get_episode
from roboirg_learn.listener.listener_net import ListenerNet
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.listener.vocabulary import Vocabulary, parts_of_tasks
from roboirg_learn.policy.moves import Move
from roboirg_learn.policy.object_detector import ObjectDetector
from roboirg_learn.policy.policy_plan import PLANNERS, BodyPlan
from roboirg_learn.policy.subgoals import templates_of
from roboirg_learn.policy.task_net import TaskNet
from roboirg_learn.policy.trained_body import GoalLayout, TrainedBody, make_body, save_body
from roboirg_learn.policy.trained_reader import TrainedReader, save_reader


def reader_for(classes, goals, **plan):
    """Return a reader that fits a body of these classes and goals."""
    vocabulary = Vocabulary(("cube", "pick"), classes, goals.tasks, goals.parts)
    about = ReaderPlan(goals.tasks, **plan).about
    task_net = TaskNet(vocabulary).eval()
    net = ListenerNet(vocabulary).eval()
    return TrainedReader(vocabulary, np.zeros((4, 2)), task_net, net, about)


def save_policy(files, memory, objects):
    """Write the body and the reader of a policy for PickXtimes, which knows some objects."""
    torch.manual_seed(0)
    goals = GoalLayout(("PickXtimes",), parts_of_tasks(["PickXtimes"]))
    moves = Move(True, 0.0, 0.0, 0.15, "align", 0.0), Move(False, 0.0, 0.0, 0.1, "keep", 0.0)
    plan = BodyPlan(goals.tasks, memory)
    templates = ()
    planner = None
    if memory in PLANNERS:
        templates = templates_of([get_episode("PickXtimes", "train", 0)])
        planner = make_body(objects, goals, templates, memory)
    acts = make_body(objects, goals, moves, plan.of_net.memory)
    detector = ObjectDetector(len(objects.names))
    body = TrainedBody(objects, detector, goals, moves, acts, plan.about, templates, planner)
    save_body(body, files.body)
    save_reader(reader_for(objects.names, goals), files.reader)
