"""The plots of the report on chapter 6."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from paramove.documents import Floats
from studies.chapter6.measures import LOST_OTHERWISE_M, Track

HUES = {
    (0, 1, 2, 3): "#1d2530", (0,): "#2f6fc4", (1,): "#c8372d", (2,): "#1f7a45", (3,): "#a86a00", (1, 3): "#7a4fb5"
}  # fmt: skip
AXES, AXIS_HUES = ("x", "y", "z"), ("#c8372d", "#1f7a45", "#2f6fc4")
ACTION_HUES = ("#2f6fc4", "#c8372d", "#1f7a45")
MAX_DRAWN_CM = 40.0


def name_of(views: tuple[int, ...]) -> str:
    """Of a set of views, for a legend."""
    cameras = ", ".join(str(view + 1) for view in views)
    return "all cameras" if len(views) == 4 else f"camera{'s' if len(views) > 1 else ''} {cameras}"


def over_time(figure: Figure, tracks: Sequence[Track]) -> None:
    """Errors of targets and poses (figures 6.15, 6.19, 6.20) and deviation of theta (6.17) of one clip."""
    panels = figure.subplots(3, 1, sharex=True)
    for track in tracks:
        hue, width = HUES[track.views], 2.0 if len(track.views) == 4 else 1.1
        for axes, values in zip(
            panels, (100.0 * track.pose_errors, 100.0 * track.pointed_errors, track.theta_deviation), strict=True
        ):
            axes.plot(track.times_s, values, color=hue, lw=width, label=name_of(track.views))
    for axes, title in zip(panels, ("pose, RMS cm", "target of θ, cm", "deviation of θ"), strict=True):
        axes.set_ylabel(title)
        axes.set_ylim(0.0, min(MAX_DRAWN_CM, axes.get_ylim()[1]))
        mark_acts(axes, tracks[0])
    panels[0].legend(ncols=6, fontsize=7, loc="upper right")
    panels[-1].set_xlabel("s")


def deviations(figure: Figure, tracks: Sequence[Track]) -> None:
    """Standard deviation of the hypothesised hand along each axis (figure 6.16), one panel per set of views."""
    panels = figure.subplots(1, len(tracks), sharey=True, squeeze=False)[0]
    for axes, track in zip(panels, tracks, strict=True):
        for axis in range(3):
            axes.plot(track.times_s, 100.0 * track.hand_deviations[:, axis], color=AXIS_HUES[axis], label=AXES[axis])
        axes.set(title=name_of(track.views), xlabel="s")
        mark_acts(axes, track)
    panels[0].set_ylabel("deviation of the hand, cm")
    panels[-1].legend(fontsize=7)


def hand_and_truth(figure: Figure, track: Track) -> None:
    """Position of the hand: true, best hypothesis, and this median filtered (figure 6.11)."""
    true = track.true_poses[:, -3:]
    for axis, axes in enumerate(figure.subplots(3, 1, sharex=True)):
        axes.plot(track.times_s, 100.0 * track.best_hands[:, axis], color="#39424e", lw=0.6, label="best hypothesis")
        filtered = true[:, axis] + track.median_errors[:, axis]
        axes.plot(track.times_s, 100.0 * filtered, color="#c8372d", lw=1.3, label="median filtered")
        axes.plot(track.times_s, 100.0 * true[:, axis], color="#1f7a45", lw=1.3, label="true")
        axes.set_ylabel(f"{AXES[axis]}, cm")
        mark_acts(axes, track)
    figure.axes[0].legend(ncols=3, fontsize=7)
    figure.axes[-1].set_xlabel("s")


def posteriors(figure: Figure, track: Track) -> None:
    """Posterior of each action (figure 6.24) and, below, of the progress of each (figure 6.28)."""
    names = list(track.actions)
    panels = figure.subplots(1 + len(names), 1, sharex=True, height_ratios=[1.4, *[1.0] * len(names)])
    for name, hue in zip(names, ACTION_HUES, strict=False):
        panels[0].plot(track.times_s, track.actions[name], color=hue, label=name)
    panels[0].set(ylabel="posterior", ylim=(-0.03, 1.03), title=name_of(track.views))
    panels[0].legend(ncols=3, fontsize=7)
    mark_acts(panels[0], track)
    extent = (float(track.times_s[0]), float(track.times_s[-1]), 0.0, 1.0)
    for axes, name in zip(panels[1:], names, strict=True):
        shades = np.ma.masked_less(np.sqrt(track.tau[name].T), 0.05)
        axes.imshow(shades, origin="lower", aspect="auto", extent=extent, cmap="Blues", vmin=-0.2, vmax=0.8, zorder=1)
        axes.set_ylabel(f"τ, {name}")
        axes.grid(visible=False)
        mark_acts(axes, track)
    panels[-1].set_xlabel("s")


def mark_acts(axes: Axes, track: Track) -> None:
    """When something is performed (blue: begins), the hand is at a target (grey), an object is grasped (red)."""
    for act in track.acts:
        axes.axvline(act.start_s, color="#2f6fc4", lw=0.8)
        for arrives, leaves in zip(act.arrives_s, act.leaves_s, strict=True):
            axes.axvspan(arrives, leaves, color="#dfe4ea", lw=0, zorder=0)
        if np.isfinite(act.grasp_s):
            axes.axvline(act.grasp_s, color="#c8372d", lw=0.8)


def distributions(figure: Figure, kinds: Mapping[str, Mapping[str, Floats]], title: str, maximum: float) -> None:
    """Fraction of the values below a length, for each kind and each set of views; infinite ones are never below."""
    panels = figure.subplots(1, len(kinds), sharey=True, squeeze=False)[0]
    hues = ("#1d2530", "#c8372d", "#7a4fb5", "#a86a00")
    for axes, (kind, errors) in zip(panels, kinds.items(), strict=True):
        for (name, values), hue in zip(errors.items(), hues, strict=False):
            ordered = np.sort(values)
            fractions = np.arange(1, len(ordered) + 1) / len(ordered)
            axes.step(np.concatenate([[0.0], ordered]), np.concatenate([[0.0], fractions]), where="post", color=hue,
                      label=name)  # fmt: skip
        axes.set(title=kind, xlim=(0.0, maximum), ylim=(0.0, 1.02), xlabel=title)
    panels[0].set_ylabel("fraction of all")
    panels[-1].legend(fontsize=7, loc="lower right")


def sight(figure: Figure, tracks: Sequence[Track]) -> None:
    """Errors along the line of sight over errors across it, one panel per camera."""
    panels = figure.subplots(1, 4, sharex=True, sharey=True)
    limit = 100.0 * LOST_OTHERWISE_M * 2
    for camera, axes in enumerate(panels):
        pairs = [track.sight_errors() for track in tracks if track.views == (camera,)]
        for along, across in pairs:
            axes.plot(100.0 * across, 100.0 * along, ".", ms=1.6, color=HUES[(camera,)], alpha=0.35)
        axes.axline((0.0, 0.0), slope=1.0, color="#9aa3ad", lw=0.7)
        axes.axline((0.0, 0.0), slope=-1.0, color="#9aa3ad", lw=0.7)
        axes.set(title=f"camera {camera + 1}", xlabel="across, cm", xlim=(0.0, limit), ylim=(-limit, limit))
    panels[0].set_ylabel("away from the camera, cm")
