"""The stereo body tracker on streams of images: which images show one moment, where the arm is, and what is wrong."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field, model_validator

from paramove.cameras import AlignedViews, CalibratedCamera, CameraWatch, Views, measured_cameras
from paramove.documents import Image, InputError
from paramove.objects import Colour
from paramove.observation.markers import ArucoMarker, BodyTrackerOptions, MarkedPoint, StereoBodyTracker

UNSEEN_S = 3.0
"""A point that was not seen by two cameras for so long is told. A hand that rests below the table comes back sooner."""


@dataclass(frozen=True)
class BodyMoment:
    """The marked points of one moment.

    Attributes:
        captured_ns: Of the images.
        points: Those that at least two cameras saw.
    """

    captured_ns: int
    points: Mapping[str, MarkedPoint]


class BodyTracking:
    """Brings the images of one moment together and finds the marked points in them.

    Args:
        cameras: As calibrated.
        options: What marks which point.
        period_s: Time between two images of a camera, s.

    Raises StereoError for fewer than two cameras, InputError for markers given twice or none.
    """

    def __init__(self, cameras: Sequence[CalibratedCamera], options: BodyTrackerOptions, period_s: float) -> None:
        self._tracker = StereoBodyTracker(cameras, options)
        self._calibrated = {camera.name: camera for camera in cameras}
        self._views = AlignedViews(list(self._calibrated), period_s)
        self._names = tuple(options.markers)
        self._watch = CameraWatch(cameras)
        self._seen_ns: dict[str, int] = {}
        self._latest_ns = 0

    @property
    def cameras(self) -> dict[str, CalibratedCamera]:
        """By their names."""
        return self._calibrated

    @property
    def point_names(self) -> tuple[str, ...]:
        """Of the marked points."""
        return self._names

    def see(self, camera: str, captured_ns: int, image: Image) -> Iterator[BodyMoment]:
        """The moments that this image of a calibrated camera completes.

        One of another size than calibrated is left out and told; so is a late one, untold.
        """
        if self._watch.accepts(camera, captured_ns, image):
            for views in self._views.add(camera, captured_ns, image):
                yield self._moment(views)

    def cannot_see(self, camera: str, captured_ns: int, why: str) -> None:
        """An image that could not even be read."""
        self._watch.refuse(camera, captured_ns, why)

    def tick(self, now_ns: int) -> None:
        """Time has passed, with images or without."""
        self._watch.tick(now_ns)

    def trouble(self) -> str:
        """What cameras and markers do not tell at present; "" if all is well."""
        return "; ".join([*self._watch.troubles(), *self._unseen()])

    def _moment(self, views: Views) -> BodyMoment:
        points = self._tracker.located(views.images)
        self._latest_ns = views.captured_ns
        for name in self._names:
            self._seen_ns.setdefault(name, views.captured_ns)
            if name in points:
                self._seen_ns[name] = views.captured_ns
        return BodyMoment(views.captured_ns, points)

    def _unseen(self) -> list[str]:
        names = [name for name, seen_ns in self._seen_ns.items() if self._latest_ns - seen_ns > UNSEEN_S * 1e9]
        if not names:
            return []
        return [f"no two cameras see {', '.join(names)}: turn the markers to the cameras, or look at the light"]


class MarkerSetup(BaseModel):
    """What marks a point of the arm: a printed marker with its number, or a colour that nothing else in view has.

    Attributes:
        number: Of an ArUco marker, 60 to 99; `paramove calibrate markers` prints them.
        inset: How deep below the marker's middle the point lies, m.
        hue_deg: Lower and upper hue of a colour, degrees.
        saturation: Its smallest saturation, 0 to 1.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    number: int | None = None
    inset: float = 0.0
    hue_deg: tuple[float, float] | None = None
    saturation: float = 0.45

    @model_validator(mode="after")
    def _check(self) -> MarkerSetup:
        if (self.number is None) == (self.hue_deg is None):
            raise ValueError("a marker has either a number or a colour (hue_deg: [lower, upper])")
        return self

    def marker(self, name: str) -> ArucoMarker | Colour:
        """For `StereoBodyTracker`. Raises InputError for a number or a colour that there is not."""
        if self.hue_deg is None:
            assert self.number is not None
            return ArucoMarker(self.number, self.inset)
        try:
            return Colour(name, self.hue_deg, self.saturation)
        except ValueError as error:
            raise InputError(str(error)) from error


class BodyTrackingSetup(BaseModel):
    """Parameters of a body tracker. Its files are looked for in the run's folder first, then in the workspace.

    Attributes:
        cameras: Calibration file; its cameras are camera_1, camera_2, … in their order.
        markers: Name of a point of the arm, as `ArmPose` has it -> what marks it.
        max_residual_px: A point whose views disagree by more is left out.
        rate_hz: Of the cameras.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    cameras: Path = Path("cameras.yaml")
    markers: dict[str, MarkerSetup] = Field(
        default={"elbow": MarkerSetup(number=91), "wrist": MarkerSetup(number=92), "index": MarkerSetup(number=93)},
        min_length=1,
    )
    max_residual_px: float = Field(default=BodyTrackerOptions.max_residual_px, gt=0.0, le=50.0)
    rate_hz: float = Field(default=15.0, gt=0.5, le=240.0)

    def body_tracking(self, run_folder: Path = Path()) -> BodyTracking:
        """Reads the calibration. Raises InputError."""
        cameras = measured_cameras(run_folder, self.cameras)
        markers = {name: one.marker(name) for name, one in self.markers.items()}
        options = BodyTrackerOptions(markers=markers, max_residual_px=self.max_residual_px)
        return BodyTracking(cameras, options, 1.0 / self.rate_hz)
