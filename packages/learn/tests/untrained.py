"""Parts of policies that have learned nothing."""

import numpy as np

from roboirg_learn.listener.listener_net import ListenerNet
from roboirg_learn.listener.reader_plan import ReaderPlan
from roboirg_learn.listener.vocabulary import Vocabulary
from roboirg_learn.policy.task_net import TaskNet
from roboirg_learn.policy.trained_reader import TrainedReader


def reader_for(classes, goals, **plan):
    """Return a reader that fits a body of these classes and goals."""
    vocabulary = Vocabulary(("cube", "pick"), classes, goals.tasks, goals.parts)
    about = ReaderPlan(goals.tasks, **plan).about
    task_net = TaskNet(vocabulary).eval()
    net = ListenerNet(vocabulary).eval()
    return TrainedReader(vocabulary, np.zeros((4, 2)), task_net, net, about)
