"""Parameters of a tracker's process: cameras, person, actions, grammar."""

from __future__ import annotations

from pathlib import Path

from pydantic import BaseModel, ConfigDict, Field

from paramove.action_space.grammar import Grammar
from paramove.action_space.grammar_file import read_grammar
from paramove.action_space.messages import TablePose
from paramove.action_space.particle_filter import FilterOptions
from paramove.action_space.person import measured_person
from paramove.action_space.target_detection import DetectionOptions
from paramove.action_space.track_health import HealthOptions
from paramove.action_space.tracker import ActionTracker, TrackerOptions
from paramove.action_space.training import table_action
from paramove.action_space.video_tracker import VideoTracker
from paramove.action_space.vocabulary import ActionModel, Vocabulary
from paramove.cameras import measured_cameras
from paramove.documents import InputError
from paramove.observation import ArmObserver
from paramove.phmm import ParametricHMM, PolynomialPHMM

MIN_GROWN = 0.8
"""Minimum arm length of adults, relative to the demonstrator's."""
SYNTHETIC = ("pointing", "reaching")


class TrackingSetup(BaseModel):
    """Parameters of a tracker. Its files are looked for in the run's folder first, then in the workspace.

    Attributes:
        cameras: Calibration file; its cameras are camera_1, camera_2, … in their order.
        person: File of the person's measures; without one, the synthetic demonstrator's.
        table: Corners of the table's top in order, (x, y) in m in its frame; it hides an arm that hangs below.
        table_place: Pose of the table frame in the frame of the estimates, such as a robot's.
        actions: "pointing" or "reaching" on the table as the synthetic demonstrator performs them, or files of models
            of arm poses over (u, v).
        grammar: File; without one, any of the actions follows any.
        particles: Hypotheses.
        min_log_likelihood: Of the best hypothesis, nats; below it for half a second the arm is lost, whatever is
            usual for the track. For cameras that see the arm only at times; None: lost only by comparison with earlier.
        rate_hz: Of the cameras.
        seed: Of the filter.
    """

    model_config = ConfigDict(extra="forbid", frozen=True)

    cameras: Path = Path("cameras.yaml")
    person: Path | None = None
    table: tuple[tuple[float, float], ...] | None = Field(default=None, min_length=3)
    table_place: TablePose = TablePose()
    actions: tuple[str, ...] = Field(default=("pointing",), min_length=1)
    grammar: Path | None = None
    particles: int = Field(default=400, ge=50, le=20_000)
    min_log_likelihood: float | None = None
    rate_hz: float = Field(default=15.0, gt=0.5, le=240.0)
    seed: int = Field(default=0, ge=0)

    def video_tracker(self, run_folder: Path = Path()) -> VideoTracker:
        """Reads the files, trains and compiles what is not cached yet. Raises InputError."""
        cameras = measured_cameras(run_folder, self.cameras)
        person = measured_person(run_folder, self.person)
        vocabulary = Vocabulary([_action(name) for name in self.actions])
        grammar = Grammar.choice(list(vocabulary.names)) if self.grammar is None else read_grammar(self.grammar)
        options = TrackerOptions(
            filter=FilterOptions(n_particles=self.particles),
            detection=_detection(person.placement.scale),
            health=HealthOptions(min_log_likelihood=self.min_log_likelihood),
        )
        tracker = ActionTracker(vocabulary, grammar, person.placement, options, self.seed)
        observer = ArmObserver(person.sizes, cameras, table=self.table)
        video = VideoTracker(tracker, observer, cameras, 1.0 / self.rate_hz)
        video.warm_up()
        return video


def _detection(scale: float) -> DetectionOptions:
    """Options for the size of a person: adults all use the defaults."""
    return DetectionOptions() if scale > MIN_GROWN else DetectionOptions().scaled(scale)


def _action(name: str) -> ActionModel:
    """A synthetic action, or the model of a file."""
    if name in SYNTHETIC:
        return table_action("pointing" if name == "pointing" else "reaching")
    path = Path(name)
    if not path.is_file():
        raise InputError(
            f"action {name!r}: {', '.join(SYNTHETIC)} or the file of a model expected; this file does not exist",
            missing=True,
        )
    model = ParametricHMM.load(path)
    if not isinstance(model, PolynomialPHMM):
        raise InputError(
            f"{path}: expected a polynomial model, found a {type(model).__name__}: train one with "
            "paramove train --model quadratic"
        )
    return ActionModel.from_file_model(model)
