"""One table says what each kind of fact means, and a kind from outside needs nothing else."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from staged import named_facts

import roboirg
from roboirg.analysis.page.details import event_text
from roboirg.apps.show.episode_text import fact_words
from roboirg.core import fact_traits
from roboirg.core.conditions import Fact
from roboirg.core.episode import Primitive, Scene, SceneObject, Stage
from roboirg.core.errors import InvalidValueError, UnknownNameError
from roboirg.core.fact_traits import FACT_TRAITS, FactRole, FactTraits, register_fact_kind
from roboirg.core.motions import Glow, Point, Shuttle, Vanish
from roboirg.judging import Judge
from roboirg.judging.grounding_errors import classify_grounding_error
from roboirg.records.record import EventRecord
from roboirg.tasks import every_task
from roboirg.tasks.splits.splits import get_episode

SOURCE = Path(roboirg.__file__).parent


def kinds_written_in(path):
    """Return the kinds in texts such as `Fact("picked"` of a source file: *picked*."""
    return set(re.findall(r"\bFact\(\s*\"(\w+)\"", path.read_text()))


ATTEMPTS = {kind for kind, traits in FACT_TRAITS.items() if traits.role is FactRole.ATTEMPT}
"""The kinds of the table that are failed tries, such as *clutched*."""


def test_attempt_detection_makes_every_kind_of_attempt_in_the_table_of_traits():
    """An attempt is a failed try, such as fingers that close on nothing. The file that detects them
    names each kind that the table marks as one, and a pressed button, next to which a press is no
    attempt."""
    detected = kinds_written_in(SOURCE / "simulation" / "attempt_detection.py")

    assert detected == ATTEMPTS | {"pressed"}


def test_fact_detection_makes_every_other_kind_of_fact_in_the_table_of_traits():
    """A fact is what holds in the world, such as a cube that is *picked*. The file that detects
    facts names each kind of the table but attempts."""
    detected = kinds_written_in(SOURCE / "simulation" / "fact_detection.py")

    assert detected == set(FACT_TRAITS) - ATTEMPTS


def test_no_source_file_names_a_kind_of_fact_that_is_not_in_the_table_of_traits():
    """A kind in a text such as `Fact("picekd"`, with a slip, would never hold."""
    for path in SOURCE.rglob("*.py"):
        assert kinds_written_in(path) <= set(FACT_TRAITS), path


def facts_named_in(episode):
    """Return all facts that stages, motions and the past of an episode name."""
    facts = {*named_facts((*episode.demonstration, *episode.stages)), *episode.scene.past}
    for motion in episode.scene.motions:
        match motion:
            case Glow(during=fact) | Vanish(when=fact) | Shuttle(stopped_by=fact):
                facts.add(fact)
    return facts


@pytest.mark.parametrize("task", every_task())
def test_facts_in_tasks_are_about_objects_that_their_kind_allows(task):
    """The table of traits says of each kind of fact which kinds of objects it can be about, and at
    which places: *picked* is about a cube or a tape and has no place, *over* has one. So it must be
    for all facts that stages, motions and the video of four episodes name."""
    for index in range(4):
        episode = get_episode(task, "test", index)
        kinds = {item.name: item.kind for item in episode.scene.objects}
        kinds |= {"robot": "robot", None: None}
        for fact in facts_named_in(episode):
            traits = FACT_TRAITS[fact.kind]
            assert kinds[fact.subject] in traits.subjects, fact
            assert kinds[fact.place] in (traits.places or [None]), fact


@pytest.mark.parametrize("kind", FACT_TRAITS)
def test_the_words_of_a_kind_of_fact_name_its_subject_and_place(kind):
    """The words of a kind of fact have gaps, as in *placed {subject} on {place}*. They must have
    one for the place if the kind has places, and one for the subject unless that is always the
    robot, which is not named: *pressed the red button* has a button as its subject."""
    traits = FACT_TRAITS[kind]

    words = traits.past.format(subject="SUBJECT", place="PLACE")

    assert ("PLACE" in words) == bool(traits.places)
    assert ("SUBJECT" in words) == (traits.subjects != ("robot",))


@pytest.mark.parametrize("kind", ["{0.real}", "{place}", "{", "}}"])
def test_braces_in_an_unknown_kind_of_fact_are_shown_as_they_are(kind):
    """A stranger's record may have them; they would be filled in, or raise `KeyError`."""
    event = EventRecord(step=1, kind=kind, subject="cube", place="disc")

    assert event_text(event, {}) == f"{kind} cube"


def test_an_unknown_kind_of_fact_is_shown_by_its_name_and_does_not_last():
    """A stranger's record may name a kind that is not in the table: its underscores become spaces,
    and it counts only while it holds."""
    fact = Fact("turned_over", "cup")

    assert fact_words(fact) == "cup turned over"
    assert not fact.traits.lasts


# From outside

TOPPLED = Fact("toppled", "pillar")


@pytest.fixture
def registered_toppled(monkeypatch):
    """The traits of *toppled*, a kind of fact that the package of a stranger registers."""
    added = dict(FACT_TRAITS)
    monkeypatch.setattr(fact_traits, "_TRAITS", added)
    monkeypatch.setattr(fact_traits, "FACT_TRAITS", added)
    traits = FactTraits(
        role=FactRole.PRESS,
        subjects=("pillar",),
        holds_while="its center has been beyond x 0.05",
        past="knocked {subject} over",
        state="knocked over",
        lasts=True,
        detect=lambda context: (
            Fact("toppled", name)
            for name, body in context.bodies.items()
            if body.item.kind == "pillar" and body.position.x > 0.05
        ),
    )
    register_fact_kind("toppled", traits)
    return traits


def stage_that_expects(expects, *forbids):
    return Stage(expects, Primitive("hold", "robot"), "leave the pillar alone", forbids)


def test_a_registered_kind_of_fact_can_be_forbidden_and_is_judged(registered_toppled):
    """The fixture has registered *toppled*, with the words "knocked {subject} over". The stage
    expects the robot at home and forbids that the pillar is toppled, which it is at the first
    step."""
    pillar = SceneObject("pillar", "pillar", Point(0.0, 0.0, 0.05), color="red")
    judge = Judge([stage_that_expects(Fact("home", "robot"), TOPPLED)], Scene((pillar,)))

    judge.update(0, frozenset([TOPPLED]))

    assert judge.cause == "knocked the red pillar over; expected: leave the pillar alone"


def test_a_registered_kind_of_fact_is_described_in_the_words_it_brings(registered_toppled):
    """The fixture has registered *toppled*, a kind of fact, with the words "knocked {subject} over"
    for an event and "knocked over" for a state. The names of objects are a dictionary from names to
    words; without any, the name itself stands there. TOPPLED is that the pillar is toppled."""
    begins = EventRecord(step=3, kind="toppled", subject="pillar", place=None, holds=True)
    ends = EventRecord(step=9, kind="toppled", subject="pillar", place=None, holds=False)

    assert fact_words(TOPPLED) == "pillar knocked over"
    assert event_text(begins, {"pillar": "the red pillar"}) == "knocked the red pillar over"
    assert event_text(ends, {}) == "knocked pillar over; this no longer holds"


def test_a_failure_by_a_registered_kind_of_fact_is_named_by_its_role(registered_toppled):
    """The plan is to pick a cube, to topple a pillar and to carry the cube over a target; the pick
    is due. The fixture has registered *toppled* with the role of a press, which ends a task: done
    too early, it is a wrong count. A cube carried over a target too early is a wrong order."""
    carried = Fact("over", "cube", "target_left")
    plan = [stage_that_expects(fact) for fact in (Fact("picked", "cube"), TOPPLED, carried)]

    assert classify_grounding_error(TOPPLED, plan, 0) == "wrong_count"
    assert classify_grounding_error(carried, plan, 0) == "wrong_order"


def test_registering_the_same_kind_of_fact_again_is_allowed(registered_toppled):
    """The fixture has registered *toppled* and holds its traits. The same traits again, as when a
    package is imported twice, raise nothing."""
    register_fact_kind("toppled", registered_toppled)


def test_registering_a_kind_of_fact_under_a_taken_name_is_refused(registered_toppled):
    """*Picked* is a kind of the benchmark. The fixture has registered *toppled* and holds its
    traits, which are others."""
    with pytest.raises(InvalidValueError, match="already a kind of fact 'picked'"):
        register_fact_kind("picked", registered_toppled)


def build_pillar(scene, item, visible):
    """Build an invisible pillar, 4 cm wide and 10 cm high."""
    from sapien.wrapper.actor_builder import ActorBuilder

    from roboirg.simulation import bodies

    builder = ActorBuilder()
    builder.add_box_collision(half_size=[0.02, 0.02, 0.05])
    return bodies.finish_body(builder, scene, item, "dynamic")


@pytest.fixture
def registered_pillar(monkeypatch):
    from roboirg.simulation import bodies

    added = dict(bodies.BODY_BUILDERS)
    monkeypatch.setattr(bodies, "_BUILDERS", added)
    monkeypatch.setattr(bodies, "BODY_BUILDERS", added)
    bodies.register_body_builder("pillar", build_pillar)


SCENE_WITH_A_PILLAR = Scene((SceneObject("pillar", "pillar", Point(0.0, 0.0, 0.05)),))


@pytest.mark.sim
def test_an_unknown_kind_of_object_is_refused():
    """The scene has an object of the kind *pillar*, for which nothing is registered here."""
    from roboirg.simulation.world import World

    with pytest.raises(UnknownNameError, match="no kind of object 'pillar'"):
        World(SCENE_WITH_A_PILLAR, visible=False)


@pytest.mark.sim
def test_registering_a_kind_of_object_under_a_taken_name_is_refused():
    """*Cube* is a kind of the benchmark, which has its own builder; `build_pillar` is another one,
    which could not build cubes."""
    from roboirg.simulation import bodies

    with pytest.raises(InvalidValueError, match="already a kind of object 'cube'"):
        bodies.register_body_builder("cube", build_pillar)


@pytest.mark.sim
def test_a_registered_kind_of_object_is_built_and_its_kind_of_fact_detected(
    registered_toppled, registered_pillar, monkeypatch
):
    """The fixtures have registered *pillar*, a kind of object, with its builder, and *toppled*, a
    kind of fact: it holds of a pillar whose center is beyond x = 0.05 m, and lasts once it has
    held. The detection of facts gets the table with *toppled*. The pillar stands at x = 0, is put
    to x = 0.1 m, and back."""
    from roboirg.simulation import fact_detection
    from roboirg.simulation.physics_settings import HOME_ACTION
    from roboirg.simulation.world import World

    monkeypatch.setattr(fact_detection, "FACT_TRAITS", fact_traits.FACT_TRAITS)
    world = World(SCENE_WITH_A_PILLAR, visible=False)

    facts_at_first = world.step(HOME_ACTION)
    world.bodies["pillar"].put(Point(0.1, 0.0, 0.05))
    facts_beyond = world.step(HOME_ACTION)
    world.bodies["pillar"].put(Point(0.0, 0.0, 0.05))
    facts_back = world.step(HOME_ACTION)

    toppled = Fact("toppled", "pillar")
    assert toppled not in facts_at_first
    assert toppled in facts_beyond
    assert toppled in facts_back
