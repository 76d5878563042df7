"""Tracking in action space: the arm followed as action, parameters and progress (thesis chapter 6)."""

from paramove.action_space.grammar import Grammar
from paramove.action_space.grammar_file import read_grammar
from paramove.action_space.particle_filter import FilterOptions
from paramove.action_space.placement import PersonPlacement
from paramove.action_space.setup import Person, TrackingSetup
from paramove.action_space.target_detection import DetectedTarget, DetectionOptions
from paramove.action_space.track_health import HealthOptions
from paramove.action_space.tracker import ActionBelief, ActionTracker, TrackerOptions
from paramove.action_space.training import table_action
from paramove.action_space.video_tracker import TrackedMoment, VideoTracker
from paramove.action_space.vocabulary import ActionModel, Vocabulary

__all__ = [
    "ActionBelief",
    "ActionModel",
    "ActionTracker",
    "DetectedTarget",
    "DetectionOptions",
    "FilterOptions",
    "Grammar",
    "HealthOptions",
    "Person",
    "PersonPlacement",
    "TrackedMoment",
    "TrackerOptions",
    "TrackingSetup",
    "VideoTracker",
    "Vocabulary",
    "read_grammar",
    "table_action",
]
