"""A person's arm tracked in the images of calibrated cameras: images in, estimates of the arm out."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from paramove.action_space.tracker import ActionTracker, TrackEstimate
from paramove.cameras import AlignedViews, CalibratedCamera, CameraWatch, Views
from paramove.documents import Floats, Image
from paramove.observation import ArmObserver, BodyKeyPoints, KeyPointObserver, Presence

MIN_SHARPNESS = 3.0
"""Grey levels per px that the strongest edges of an image reach; noise in the dark stays below 2, a lit scene is above
10."""
LONGEST_WAIT_NS = 150_000_000
"""A set goes on without its key points after this time. Nothing waits for a detector that takes longer."""
GONE_NS = 1_000_000_000
"""Without key points for this long nothing waits for them."""

Timed = tuple[int, Image]
"""When an image was captured, ns, and the image."""
Awaited = tuple[Views[Timed], list[BodyKeyPoints | None]]


@dataclass(frozen=True)
class TrackedState:
    """The estimate at one time, and what is drawn of it.

    Attributes:
        captured_ns: Of the images.
        estimate: Of the filter.
        outline: Of the estimated arm in the first camera's image as captured, (N, 2) px.
        ball: The estimated target in that image, (2,) px; NaN if it is not in front of the camera.
        pointed: The estimated target, (3,), m, in the world.
        pointed_deviation, target_deviation: Along each axis, (3,), m, of `pointed` and of the detected target; the
            latter zeros if none is detected.
        n_views: How many cameras had a usable image at this time.
    """

    captured_ns: int
    estimate: TrackEstimate
    outline: Floats
    ball: Floats
    pointed: Floats
    pointed_deviation: Floats
    target_deviation: Floats
    n_views: int


def track_frame(tracker: ActionTracker, observer: ArmObserver, time_s: float) -> TrackEstimate:
    """The estimate from the images of the observer, which then learns the background around the estimated arm."""
    elapsed_s = _since_last(tracker, time_s)
    estimate = tracker.update(time_s, observer.log_likelihoods, observer.presence)
    _learn(tracker, observer, estimate, elapsed_s)
    return estimate


def _since_last(tracker: ActionTracker, time_s: float) -> float:
    return 0.0 if tracker.estimate is None else time_s - tracker.estimate.time_s


def _learn(tracker: ActionTracker, observer: ArmObserver, estimate: TrackEstimate, elapsed_s: float) -> None:
    if tracker.health.absence or not (estimate.lost or estimate.degraded):  # what has come to stay is learned slowly
        observer.learn(estimate.pose, elapsed_s)


def compile_observer(trial: ArmObserver, camera: CalibratedCamera, poses: Floats) -> None:
    """An observer of one camera compares postures (N, 9), m, with noise, so that everything is compiled."""
    noise = np.random.default_rng(0)
    for _ in range(2):  # the second image is compared with what was learned from the first
        trial.look([noise.integers(0, 255, (camera.height_px, camera.width_px, 3), dtype=np.uint8)])
        trial.log_likelihoods(poses)
        trial.learn(poses[0], 0.1)
    trial.outline(poses[0], 0)


class VideoTracker:
    """Aligns the images of the cameras in time and updates the filter with them, and with key points if there are any.

    An image waits for its key points for up to 0.15 s; without any for 1 s, nothing waits for them.

    Args:
        tracker: The filter.
        observer: Compares postures with images; its cameras are `cameras`.
        cameras: As calibrated, in the order of the observer.
        period_s: Time between two images of a camera, s.

    Attributes:
        cameras: By their names.
        watch: Which of them give usable images; takes those that cannot be decoded.
    """

    def __init__(
        self, tracker: ActionTracker, observer: ArmObserver, cameras: Sequence[CalibratedCamera], period_s: float
    ) -> None:
        self._tracker = tracker
        self._observer = observer
        self._key_points = KeyPointObserver(observer.sizes, cameras)
        self.cameras = {camera.name: camera for camera in cameras}
        self._awaited = AwaitedKeyPoints(list(self.cameras))
        self._views = AlignedViews[Timed](list(self.cameras), period_s)
        self._started_ns: int | None = None
        self.watch = CameraWatch(cameras, period_s)
        self._dark: list[str] = []
        self._uncertainty = ""

    def warm_up(self) -> None:
        """Compiles everything in advance, so that the first image does not wait for the compiler."""
        tracked = self._tracker.filter
        moved = tracked.propagation.predicted(tracked.particles, 0.1, np.random.default_rng(0))
        first = next(iter(self.cameras.values()))
        trial = ArmObserver(self._observer.sizes, [first], self._observer.options, table=self._observer.table)
        compile_observer(trial, first, self._tracker.placement.in_world(moved.poses))

    @property
    def parameter_names(self) -> dict[str, tuple[str, ...]]:
        """Of each action."""
        return {action.name: action.parameter_names for action in self._tracker.vocabulary.actions}

    def see(self, camera: str, captured_ns: int, image: Image) -> Iterator[TrackedState]:
        """The states that this image completes. An image of another size than calibrated is ignored.

        The background is learned when the next state is requested: an estimate does not wait for that.
        """
        if self.watch.accepts(camera, captured_ns, image):
            for views in self._views.add(camera, captured_ns, (captured_ns, image)):
                yield from self._all_tracked(self._awaited.add_set(views))

    def see_key_points(self, camera: str, captured_ns: int, points: BodyKeyPoints) -> Iterator[TrackedState]:
        """The states that the key points of an image complete."""
        yield from self._all_tracked(self._awaited.add_points(camera, captured_ns, points))

    def _all_tracked(self, released: Iterator[Awaited]) -> Iterator[TrackedState]:
        for views, points in released:
            yield from self._tracked(views, points)

    def tick(self, now_ns: int) -> Iterator[TrackedState]:
        """Advances the time, with images or without; the states of images that wait no longer for key points."""
        self.watch.tick(now_ns)
        yield from self._all_tracked(self._awaited.released(now_ns))

    def trouble(self) -> str:
        """Why images are not used, and what is uncertain about the arm; "" if nothing is wrong."""
        return "; ".join(
            part for part in (*self.watch.troubles(), self._awaited.trouble(), *self._dark, self._uncertainty) if part
        )

    @property
    def problem_kind(self) -> tuple[str, ...]:
        """Changes with the causes of `trouble`, not with the numbers in it."""
        estimate = self._tracker.estimate
        lost = estimate is not None and estimate.lost
        late = ("late",) if self._awaited.trouble() else ()
        return (
            *self.watch.kinds(),
            *late,
            *self._dark,
            *(("lost" if lost else "unsure",) if self._uncertainty else ()),
        )

    def _tracked(self, views: Views[Timed], points: Sequence[BodyKeyPoints | None]) -> Iterator[TrackedState]:
        self._started_ns = views.captured_ns if self._started_ns is None else self._started_ns
        self._dark = self._look([None if timed is None else timed[1] for timed in views.images])
        self._key_points.look(points)
        time_s = (views.captured_ns - self._started_ns) * 1e-9
        elapsed_s = _since_last(self._tracker, time_s)
        estimate = self._tracker.update(time_s, self._log_likelihoods, self._presence)
        estimate = replace(estimate, pose=self._key_points.corrected(estimate.pose, estimate.covariance))
        self._uncertainty = estimate.detail
        first = next(iter(self.cameras.values()))
        theta, target = estimate.theta[estimate.action], estimate.target
        pointed = estimate.targets[estimate.action]
        yield TrackedState(
            captured_ns=views.captured_ns,
            estimate=estimate,
            outline=self._observer.outline(estimate.pose, 0),
            ball=first.project(pointed),
            pointed=pointed,
            pointed_deviation=self._deviation(estimate.action, theta.mean, theta.covariance),
            target_deviation=np.zeros(3)
            if target is None
            else self._deviation(target.action, target.theta, target.covariance),
            n_views=sum(self._observer.has_image),
        )
        _learn(self._tracker, self._observer, estimate, elapsed_s)

    def _log_likelihoods(self, poses: Floats) -> Floats:
        """ln P of images and key points, taken as independent."""
        result = self._observer.log_likelihoods(poses)
        return result + self._key_points.log_likelihoods(poses) if any(self._key_points.has_points) else result

    def _presence(self, pose: Floats) -> Presence:
        """By the background, unless key points show that the arm is there: other things may change too."""
        return Presence() if self._key_points.detects(pose) else self._observer.presence(pose)

    def _look(self, images: Sequence[Image | None]) -> list[str]:
        """Gives the observer the images that contain edges; messages about the others."""
        self._observer.look(images)
        dark = self._observer.sharpness < MIN_SHARPNESS  # NaN, for a missing view, is not below
        if not dark.any():
            return []
        self._observer.look([None if bad else image for bad, image in zip(dark, images, strict=True)])
        names = [name for bad, name in zip(dark, self.cameras, strict=True) if bad]
        return [f"{name} is dark: take off the lens cap or switch on the light" for name in names]

    def _deviation(self, action: str, theta: Floats, covariance: Floats) -> Floats:
        """Of the target of the action, along each axis, (3,), m, by its slope in theta."""
        vocabulary, step = self._tracker.vocabulary, 1e-3
        target = vocabulary.actions[vocabulary.index(action)].target
        slopes = (target(theta + step * np.eye(len(theta))) - target(theta)) / step * self._tracker.placement.scale
        result: Floats = np.sqrt(np.einsum("pi,pq,qi->i", slopes, covariance, slopes))
        return result


class AwaitedKeyPoints:
    """Sets of images and key points in, sets with the key points of each image out, in the order of time.

    Args:
        names: Of the cameras, in the order of a set's images.
    """

    def __init__(self, names: Sequence[str]) -> None:
        self._points: dict[str, deque[tuple[int, BodyKeyPoints]]] = {name: deque(maxlen=16) for name in names}
        self._late_ns = dict.fromkeys(names, 0)
        self._sets: deque[Views[Timed]] = deque()
        self._now_ns = 0

    def add_set(self, views: Views[Timed]) -> Iterator[Awaited]:
        """What goes on now that there is this set."""
        self._sets.append(views)
        return self.released(views.captured_ns)

    def add_points(self, camera: str, captured_ns: int, points: BodyKeyPoints) -> Iterator[Awaited]:
        """What goes on now that there are key points of an image of this camera."""
        self._late_ns[camera] = self._now_ns - captured_ns
        self._points[camera].append((captured_ns, points))
        return self.released(self._now_ns)

    def released(self, now_ns: int) -> Iterator[Awaited]:
        """Sets that wait no longer."""
        self._now_ns = max(self._now_ns, now_ns)
        while self._sets and not self._waits(self._sets[0]):
            views = self._sets.popleft()
            images = zip(self._points, views.images, strict=True)
            yield views, [None if timed is None else self._of(camera, timed[0]) for camera, timed in images]

    def trouble(self) -> str:
        """Which detector is too slow to be waited for; "" if none is."""
        late = [
            f"{camera}, {late_ns / 1e6:.0f} ms"
            for camera, late_ns in self._late_ns.items()
            if late_ns > LONGEST_WAIT_NS
        ]
        if not late or all(self._is_gone(camera, self._now_ns) for camera in self._points):
            return ""
        return (
            f"key points come too late to be used ({'; '.join(late)} after the image): fewer cameras or a faster "
            "machine helps; until then the arm is tracked by its outline alone"
        )

    def _waits(self, views: Views[Timed]) -> bool:
        if self._now_ns - views.captured_ns >= LONGEST_WAIT_NS:
            return False
        return any(
            timed is not None and self._is_due(camera, timed[0])
            for camera, timed in zip(self._points, views.images, strict=True)
        )

    def _is_due(self, camera: str, captured_ns: int) -> bool:
        """Whether the key points of an image will probably come in time."""
        if self._is_gone(camera, captured_ns) or self._late_ns[camera] > LONGEST_WAIT_NS:
            return False
        return self._points[camera][-1][0] < captured_ns

    def _is_gone(self, camera: str, at_ns: int) -> bool:
        return not self._points[camera] or self._points[camera][-1][0] < at_ns - GONE_NS

    def _of(self, camera: str, captured_ns: int) -> BodyKeyPoints | None:
        return next((points for at_ns, points in self._points[camera] if at_ns == captured_ns), None)
