"""Results of tracks that nobody computed: a hand that goes to its targets and back, and errors as a test wants them."""

import numpy as np

RATE_HZ = 8.0
CAMERA = np.array([3.0, 0.0, 0.3])
SHOULDER, REST = np.array([-0.25, -0.18, 0.35]), np.array([-0.05, -0.35, -0.05])
NAMES = {"box": ("table_to_box", "box_to_table"), "complex": ("point", "redirect", "withdraw")}


def act(action="pointing", start_s=0.5, targets=((0.2, 0.1, 0.07),), grasp_s=None):
    """One performance: a second to each target, half a second there, a second back."""
    arrives = [start_s + 1.0 + 1.5 * number for number in range(len(targets))]
    return {
        "action": action,
        "start_s": start_s,
        "end_s": arrives[-1] + 1.5,
        "targets": [list(target) for target in targets],
        "arrives_s": arrives,
        "leaves_s": [time + 0.5 for time in arrives],
        "grasp_s": grasp_s,
        "from_true_poses": list(targets[0]),
    }


def true_hand(times_s, acts):
    knots, places = [0.0], [REST]
    for one in acts:
        knots.append(one["start_s"])
        places.append(REST)
        for target, arrives, leaves in zip(one["targets"], one["arrives_s"], one["leaves_s"], strict=True):
            knots += [arrives, leaves]
            places += [np.array(target)] * 2
        knots.append(one["end_s"])
        places.append(REST)
    return np.stack([np.interp(times_s, knots, np.array(places)[:, axis]) for axis in range(3)], axis=1)


def result(
    kind="pointing", number=0, views=(0, 1, 2, 3), likelihood="matched", acts=None, error=None, detected=None,
    rate_hz=RATE_HZ,
):  # fmt: skip
    """A stored result. `error`: of the hand, (3,) or a function of the times to (T, 3); by default none."""
    acts = [act()] if acts is None else acts
    times = np.arange(int((acts[-1]["end_s"] + 0.4) * rate_hz)) / rate_hz
    hand = true_hand(times, acts)
    off = np.zeros_like(hand) if error is None else error(times) if callable(error) else np.tile(error, (len(hand), 1))
    shoulder = np.tile(SHOULDER, (len(hand), 1))
    truth = np.hstack([shoulder, 0.5 * (shoulder + hand), hand])
    names = NAMES.get(kind, ("pointing",))
    found = {
        "times_s": times.tolist(),
        "poses": np.hstack([truth[:, :6], hand + off]).tolist(),
        "best_hands": (hand + off).tolist(),
        "hand_deviations": np.full_like(hand, 0.02).tolist(),
        "effective": [80.0] * len(hand),
        "lost": [0] * len(hand),
        "actions": {name: [1.0 / len(names)] * len(hand) for name in names},
        "tau": {name: np.full((len(hand), 20), 0.05 / len(names)).tolist() for name in names},
        "theta_deviation": [0.1] * len(hand),
        "pointed": np.tile(acts[0]["targets"][0], (len(hand), 1)).tolist(),
        "detected": exactly_detected(acts) if detected is None else detected,
        "seconds": [0.02] * len(hand),
    }
    return {
        "clip": f"{kind}_{number:02d}",
        "kind": kind,
        "number": number,
        "split": "held_out" if number % 3 == 2 else "tuning",
        "views": list(views),
        "likelihood": likelihood,
        "seed": 0,
        "values": found,
        "truth": {"poses": truth.tolist(), "acts": acts},
        "sight": {"position": CAMERA.tolist(), "focal_px": 340.0} if len(views) == 1 else None,
    }


def detection(number, time_s, place, actions=("pointing",)):
    return {
        "number": number,
        "said_s": time_s,
        "time_s": time_s,
        "actions": list(actions),
        "place": list(place),
        "deviation": 0.05,
    }


def exactly_detected(acts):
    found = []
    for one in acts:
        for place, (target, arrives) in enumerate(zip(one["targets"], one["arrives_s"], strict=True)):
            found.append(detection(len(found) + 1, arrives, target, ["redirect" if place else "pointing"]))
    return found
