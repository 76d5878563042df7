"""What is performed in each clip: kinds, numbers, truth (thesis 6.7). A third of each kind is held out from tuning."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from paramove.demonstrations import RESTING_SHOULDER, RESTING_STERNUM, SAMPLE_RATE_HZ, table_place
from paramove.documents import Floats
from sim.persons import actions
from sim.persons.performers import (
    FIRST_SEED,
    INDEX,
    BodyMotion,
    Performer,
    as_measured,
    draw_performer,
    in_person,
    joined,
)
from sim.persons.recorded import RATE_HZ, RecordedPointing, direction_place, recorded_pointing
from sim.persons.staging import StagedMovement, Stop, staged

Split = Literal["tuning", "held_out"]

REST = "rest"
FAR_REST_S = (0.6, 1.1)
BOX_ORDERS = ("AB", "BA", "AA", "BB")
"""Of the two actions of 6.7.2 in a clip, by its number."""


@dataclass(frozen=True)
class Kind:
    """A kind of clip.

    Attributes:
        name: of the kind. section: of the thesis. clips: how many there are.
        rate_hz: frames per second.
        one_view: only one view is rendered, which rotates over the four with the clip's number.
        scene: what stands on the table for it.
    """

    name: str
    section: str
    clips: int
    rate_hz: float = 8.0
    one_view: bool = False
    scene: Literal["plain", "pot", "box"] = "plain"


KINDS = (
    Kind("pointing_50fps", "6.7.1.1", 24, rate_hz=50.0, one_view=True),
    Kind("pointing", "6.7.1.2", 24),
    Kind("pointing_far", "6.7.1.3", 21),
    Kind("pouring", "6.7.1.4", 21, scene="pot"),
    Kind("box", "6.7.2", 15, scene="box"),
    Kind("complex", "6.7.3", 15),
    Kind("recorded", "6.7.1.3", 27),
)


@dataclass(frozen=True)
class Act:
    """One performance of an action in a clip; times in s from the clip's beginning.

    Attributes:
        action: name as in `actions.SHOWN`, or `recorded_pointing`; a simple pointing of 6.7.3 is `point_withdraw`, a
            dual one `point_redirect_withdraw`.
        start_s, end_s: when the hand leaves the base pose and is there again (or the recording ends).
        theta: places (n, 2) in the order in which the hand is there: (u, v) of the table, of the far plane of this
            world, or of the direction from the resting shoulder for a recorded pointing.
        targets: the same places in the world (n, 3), m.
        arrives_s, leaves_s: when the hand is at each, (n,).
        grasp_s: when the object is grasped; NaN without an object.
    """

    action: str
    start_s: float
    end_s: float
    theta: Floats
    targets: Floats
    arrives_s: Floats
    leaves_s: Floats
    grasp_s: float = float("nan")


@dataclass(frozen=True)
class Performance:
    """Input of the renderer and ground truth for an evaluator; frames at 60 Hz.

    Attributes:
        kind, number: which one.
        person: who performs.
        motion: of the body.
        labels: primitive action in each frame, or "rest", (T,).
        acts: what is performed.
        objects: where the object that is carried is in each frame of each act, (acts, T, 3), m; its middle.
        furniture: middle of the top of the box, or place of the teapot, (3,), m; NaN where the scene has none.
    """

    kind: Kind
    number: int
    person: Performer
    motion: BodyMotion
    labels: NDArray[np.str_]
    acts: tuple[Act, ...]
    objects: Floats
    furniture: Floats

    @property
    def name(self) -> str:
        """Of the clip."""
        return f"{self.kind.name}_{self.number:02d}"

    @property
    def split(self) -> Split:
        """A third is held out, by number."""
        return split_of(self.number)


def split_of(number: int) -> Split:
    """Every third clip is held out; views rotate over four, so each is held out as often."""
    return "held_out" if number % 3 == 2 else "tuning"


def kind_named(name: str) -> Kind:
    """The kind of that name. Raises ValueError with the names that exist."""
    for kind in KINDS:
        if kind.name == name:
            return kind
    raise ValueError(f"kinds of clips are {', '.join(kind.name for kind in KINDS)}; found {name!r}")


def stream(kind: Kind, number: int, purpose: int) -> np.random.Generator:
    """Random numbers of a clip for one purpose: 0 the performance, 1 the scene, 2 the cameras, 3 the sensors."""
    return np.random.default_rng((FIRST_SEED, [one.name for one in KINDS].index(kind.name), number, purpose))


def perform(kind: Kind, number: int, folder: Path | None = None) -> Performance:
    """The performance of a clip. Raises RecordingsError for kind "recorded" where the recordings are absent."""
    rng = stream(kind, number, 0)
    if kind.name == "recorded":
        return _recorded(kind, number, rng, folder)
    person = draw_performer(rng)
    count = 2 if kind.name in ("box", "complex") else 1
    furniture = _furniture(kind, person, rng)
    actions_done = []
    for turn in range(count):
        action, theta, targets, stops = _planned(kind, number, turn, person, furniture, rng)
        actions_done.append((action, theta, targets, _moved(kind, stops, person, rng)))
    rests = [float(rng.uniform(0.5, 1.1)) for _ in range(count + 1)]
    return assembled(kind, number, person, actions_done, rests, furniture, rng)


def assembled(
    kind: Kind,
    number: int,
    person: Performer,
    planned: Sequence[tuple[str, Floats, Floats, StagedMovement]],
    rests_s: list[float],
    furniture: Floats,
    rng: np.random.Generator,
) -> Performance:
    """Movements one after the other with rests before, between and after.

    planned: of each, action, places (n, 2) and (n, 3) as in `Act`, and the movement in the models' frame.
    """
    parts = [BodyMotion(in_person(moved.points, person), moved.holds) for *_, moved in planned]
    motion, spans = joined(parts, rests_s, rng)
    acts = tuple(_act(*one, span) for one, span in zip(planned, spans, strict=True))
    labels = _labels(len(motion.points), acts)
    objects = np.array([_carried(motion, act, kind) for act in acts])
    return Performance(kind, number, person, motion, labels, acts, objects, furniture)


def _furniture(kind: Kind, person: Performer, rng: np.random.Generator) -> Floats:
    """Where the fingers go at the box or the teapot, near to where the person likes it. (3,), m."""
    if kind.scene == "plain":
        return np.full(3, np.nan)
    usual = actions.BOX_PLACE if kind.scene == "box" else actions.POT_PLACE
    away = rng.uniform(-1.0, 1.0, 3) * np.array([0.03, 0.03, 0.01])
    return np.asarray(person.placement.in_world(usual) + away)


def _planned(
    kind: Kind, number: int, turn: int, person: Performer, furniture: Floats, rng: np.random.Generator
) -> tuple[str, Floats, Floats, list[Stop]]:
    """Action, places (n, 2) and (n, 3) in the world, and the stops in the models' frame."""
    placement = person.placement
    theta = rng.uniform(0.0, 1.0, (1, 2))
    if kind.name == "pointing_far":
        targets = actions.far_place(theta)
        tip = actions.fingertip_towards(placement.in_model(targets[0]), person.demonstrator.lengths)
        return "pointing_far", theta, targets, [Stop(tip)]
    dual = kind.name == "complex" and (number + turn) % 2 == 1
    if dual:
        theta = _apart(rng)
    targets = table_place(theta)
    places = [placement.in_model(target) for target in targets]
    if kind.name == "complex":
        stops = [Stop(place, 1.25 if first else 0.95, 0.5, lift=0.04) for first, place in _numbered(places)]
        return ("point_redirect_withdraw" if dual else "point_withdraw"), theta, targets, stops
    if kind.name == "pouring":
        return "pouring", theta, targets, actions.pouring_stops(places[0], placement.in_model(furniture))
    if kind.name == "box":
        takes = BOX_ORDERS[number % 4][turn] == "A"
        offset = np.array([0.0, 0.03 * (2 * turn - 1), 0.0])  # two objects find room on the box
        box = placement.in_model(furniture + offset + 0.4 * actions.BOX_SPREAD * rng.standard_normal(3))
        ends = (places[0], box) if takes else (box, places[0])
        return ("table_to_box" if takes else "box_to_table"), theta, targets, actions.carrying_stops(*ends)
    return "pointing", theta, targets, [Stop(places[0])]


def _numbered(places: list[Floats]) -> list[tuple[bool, Floats]]:
    return [(number == 0, place) for number, place in enumerate(places)]


def _apart(rng: np.random.Generator) -> Floats:
    """Two places at least 20 cm apart: to point twice at the same place is no dual pointing. (2, 2)."""
    while True:
        pair = np.asarray(rng.uniform(0.0, 1.0, (2, 2)))
        if float(np.linalg.norm(table_place(pair[0]) - table_place(pair[1]))) >= 0.20:
            return pair


def _moved(kind: Kind, stops: list[Stop], person: Performer, rng: np.random.Generator) -> StagedMovement:
    """The movement; pointing at the table once is the demonstrator's own, everything else is staged."""
    if kind.name not in ("pointing", "pointing_50fps"):
        return staged(stops, person.demonstrator, rng)
    return pointed_once(person, stops[0].place, rng)


def pointed_once(person: Performer, place: Floats, rng: np.random.Generator) -> StagedMovement:
    """The person points at a place (3,), m, of the table; all in the models' frame."""
    points = person.demonstrator.demonstrate("pointing", place, rng)
    tip = points.reshape(len(points), -1, 3)[:, INDEX]
    distance = np.linalg.norm(tip - place, axis=1)
    within = 0.02 if distance.min() < 0.02 else float(distance.min()) + 0.005  # a person may miss by more
    near = np.flatnonzero(distance < within)
    times = near[[0, -1]] / SAMPLE_RATE_HZ
    return StagedMovement(points, times[:1], times[1:], np.zeros(len(points), dtype=np.bool_))


def _act(action: str, theta: Floats, targets: Floats, moved: StagedMovement, span: tuple[float, float]) -> Act:
    arrives, leaves = span[0] + moved.arrives_s, span[0] + moved.leaves_s
    grasp = float("nan")
    if moved.holds.any():
        grasp = span[0] + float(np.argmax(moved.holds)) / SAMPLE_RATE_HZ
    at = {"box_to_table": slice(1, 2), "table_to_box": slice(0, 1), "pouring": slice(0, 1)}.get(action, slice(None))
    return Act(action, *span, theta, targets, arrives[at], leaves[at], grasp)


def _labels(n_frames: int, acts: tuple[Act, ...]) -> NDArray[np.str_]:
    """Primitive in each frame; at a place of 6.7.3 the next primitive begins in the middle of the stay."""
    labels = np.full(n_frames, REST, dtype="U24")
    times = np.arange(n_frames) / SAMPLE_RATE_HZ
    for act in acts:
        inside = (times >= act.start_s) & (times <= act.end_s)
        labels[inside] = act.action
        if act.action.startswith("point_"):
            primitives = act.action.split("_")
            middles = 0.5 * (act.arrives_s + act.leaves_s)
            number = np.searchsorted(middles, times[inside])
            labels[inside] = np.array(primitives)[number]
    return labels


def _carried(motion: BodyMotion, act: Act, kind: Kind) -> Floats:
    """Middle of the object in each frame, (T, 3): it stands where it is taken, moves with the fingers, and stays."""
    times = np.arange(len(motion.points)) / SAMPLE_RATE_HZ
    held = np.flatnonzero(motion.holds & (times >= act.start_s) & (times <= act.end_s))
    if kind.scene == "plain" or not len(held):
        return np.full((len(times), 3), np.nan)
    follows = np.clip(np.arange(len(times)), held[0], held[-1])
    return motion.grip[follows]


def recording_of(number: int, folder: Path | None = None) -> RecordedPointing:
    """The recorded movement that clip `number` of kind "recorded" plays: who moved, and to which target."""
    return _chosen_recording(number, stream(kind_named("recorded"), number, 0), folder)


def _chosen_recording(number: int, rng: np.random.Generator, folder: Path | None) -> RecordedPointing:
    everything = _recordings(folder)
    subjects = sorted({one.subject for one in everything})
    own = [one for one in everything if one.subject == subjects[number // 3 % len(subjects)]]
    return own[int(rng.integers(len(own)))]


@cache
def _recordings(folder: Path | None) -> tuple[RecordedPointing, ...]:
    return recorded_pointing(folder)


def _recorded(kind: Kind, number: int, rng: np.random.Generator, folder: Path | None) -> Performance:
    """A recorded movement, held at its beginning and its end, at the height of the person who was recorded."""
    one = _chosen_recording(number, rng, folder)
    drawn = draw_performer(rng)
    sizes = one.sizes.scaled(one.height)
    person = replace(drawn, sizes=sizes, measured=as_measured(sizes, rng), scale=one.height)
    body = _recorded_body(one, person)
    part = BodyMotion(body, np.zeros(len(body), dtype=np.bool_))
    motion, ((begin, end),) = joined([part], [float(rng.uniform(*FAR_REST_S)), 0.4], rng)
    start = begin + one.segment[0] / RATE_HZ
    arrives = begin + (one.segment[1] - 1) / RATE_HZ
    target = person.placement.in_world(direction_place(one.theta))[None]
    act = Act(
        "recorded_pointing", start, end, one.theta[None], target, np.array([arrives]), np.array([end])
    )  # fmt: skip
    nowhere = np.full((1, len(motion.points), 3), np.nan)
    return Performance(
        kind, number, person, motion, _labels(len(motion.points), (act,)), (act,), nowhere, np.full(3, np.nan)
    )


def _recorded_body(one: RecordedPointing, person: Performer) -> Floats:
    """Body points (T, 7, 3) in the world at 60 Hz; sternum, knuckle and thumb are put where they may be."""
    length = round((len(one.poses) - 1) / RATE_HZ * SAMPLE_RATE_HZ)
    times, known = np.arange(length) / SAMPLE_RATE_HZ, np.arange(len(one.poses)) / RATE_HZ
    columns = np.concatenate([one.poses, one.wrist], axis=1)
    moved = np.stack([np.interp(times, known, column) for column in columns.T], axis=1)
    shoulder, elbow, tip, wrist = np.split(moved, 4, axis=1)
    sternum = RESTING_STERNUM + 0.35 * (shoulder - RESTING_SHOULDER)
    middle = 0.5 * (wrist + tip)
    body = np.stack([sternum, shoulder, elbow, wrist, middle, tip, middle], axis=1)
    return person.placement.in_world(body.reshape(length, -1)).reshape(body.shape)
