"""Stage 1: the robot learns how the camera sees its working area (thesis 5.2.6, step 2).

It is handed an object, or fetches one from a marked position, and places it at the corners of its working area,
fetching it again each time. The image points and its own targets give the homography.
"""

from __future__ import annotations

from paramove.applications.conversation import position_at
from paramove.applications.options import Place, cm
from paramove.applications.stage import ApplicationState, Sighting, Stage
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.relocation_pb2 import RelocationGoal, RelocationStatus
from paramove.msgs.rule_pb2 import ApplicationStage, Speech
from paramove.objects import HomographyError, PlaneHomography

HELD_STILL_S = 1.0
HAND_AWAY_S = 0.5


class Calibrating(Stage):
    """States: resting, then asking_to_stand or (offering, asking, taking, letting_go), placing, looking, helped."""

    stage = ApplicationStage.STAGE_CALIBRATE

    def __init__(self, app: ApplicationState) -> None:
        super().__init__(app)
        self._held: str = ""
        self._observations: list[tuple[Place, Sighting]] = []
        self._missed = 0

    def enter(self) -> None:
        """Bring the arm to its base pose."""
        self.app.speak("I do not know yet how the camera sees the table. I will place an object at four corners.")
        self._rest()

    def on_gesture(self, gesture: Gesture) -> None:
        """Nothing: the sightings stored by the table suffice."""

    def step(self) -> ApplicationStage.Stage | None:
        """One tick."""
        steps = {
            "resting": self._resting,
            "asking_to_stand": self._asking_to_stand,
            "offering": self._offering,
            "asking": self._asking,
            "taking": self._taking,
            "letting_go": self._letting_go,
            "placing": self._placing,
            "looking": self._looking,
            "helped": self._helped,
        }
        return steps[self.app.state]()

    @property
    def _corner(self) -> Place:
        return self.app.options.corners[len(self._observations)]

    def _rest(self) -> None:
        self.app.goal_client.start(RelocationGoal.KIND_REST, self.app.now_s)
        self.app.go("resting")

    def _resting(self) -> None:
        if self.app.goal_client.outcome is not None and self.app.options.start is not None:
            self._ask_to_stand(self.app.options.start)
        elif self.app.goal_client.outcome is not None:
            self._offer()

    def _ask_to_stand(self, start: Place) -> None:
        detail = f"Please stand an object at {cm(start)} and take your hand away."
        self.app.speak(detail, Speech.REQUEST_STAND_OBJECT_AT_START)
        self.app.go("asking_to_stand")

    def _asking_to_stand(self) -> None:
        start = self.app.options.start
        assert start is not None
        self._held = self._came_to_rest()
        if self._held and self.app.table.hand_away_for(self.app.now_s) > HAND_AWAY_S:
            self._relocate(start)
        elif self.app.for_s > self.app.options.ask_again_s:
            self._ask_to_stand(start)

    def _came_to_rest(self) -> str:
        """The object that came to rest last since this state began, and has not moved for a while; "" if none."""
        since = self.app.now_s - self.app.for_s
        still = {
            sighting.time_s: name
            for name, sighting in self.app.table.objects.items()
            if sighting.at_rest and sighting.time_s > since and self.app.now_s - sighting.time_s >= HELD_STILL_S
        }
        return still[max(still)] if still else ""

    def _offer(self) -> None:
        assert self.app.options.offer is not None  # else there is a start
        offer = position_at(self.app.options.offer)
        self.app.goal_client.start(RelocationGoal.KIND_OFFER_HAND, self.app.now_s, source=offer)
        self.app.go("offering")

    def _offering(self) -> None:
        outcome = self.app.goal_client.outcome
        if self.app.goal_client.succeeded:
            self._ask()
        elif outcome is not None and outcome.state == RelocationStatus.STATE_REJECTED:
            self._ask_for_help(f"I cannot hold my hand out: {outcome.reason}")
        elif outcome is not None:
            self._rest()

    def _ask_for_help(self, detail: str) -> None:
        """The same goal would be rejected again: only a person can change that."""
        self.app.speak(f"{detail}. Please help me; I try again in a while.", Speech.REQUEST_HELP, self._held)
        self.app.go("helped")

    def _helped(self) -> None:
        if self.app.for_s > self.app.options.ask_again_s:
            self._rest()

    def _ask(self) -> None:
        self.app.speak("Please put an object into my hand and hold it there.", Speech.REQUEST_HAND_ME_AN_OBJECT)
        self.app.go("asking")

    def _asking(self) -> None:
        held = self._came_to_rest()
        if held:
            self._held = held
            self.app.goal_client.start(RelocationGoal.KIND_TAKE, self.app.now_s, self._held)
            self.app.go("taking")
        elif self.app.for_s > self.app.options.ask_again_s:
            self._ask()

    def _taking(self) -> None:
        if self.app.goal_client.succeeded:
            self.app.speak(f"I have {self._held}. Please let go.", Speech.REQUEST_LET_GO)
            self.app.go("letting_go")
        elif self.app.goal_client.outcome is not None:
            self._ask()

    def _letting_go(self) -> None:
        if self.hand_has_left(HAND_AWAY_S) and self.app.for_s > 1.0:
            target = self.app.goal_client.position(self._corner)
            self.app.goal_client.start(RelocationGoal.KIND_PLACE_HELD, self.app.now_s, self._held, target=target)
            self.app.go("placing")

    def _placing(self) -> None:
        outcome = self.app.goal_client.outcome
        if self.app.goal_client.succeeded:
            self.app.go("looking")
        elif outcome is not None and outcome.state == RelocationStatus.STATE_REJECTED:
            self._ask_for_help(f"I cannot put {self._held} at {cm(self._corner)}: {outcome.reason}")
        elif outcome is not None:
            self._start_again(outcome.reason)

    def _start_again(self, reason: str) -> None:
        self._missed += 1
        self.app.speak(f"That did not work: {reason}.")
        self._rest()

    def _looking(self) -> ApplicationStage.Stage | None:
        """The arm has left: wait for a clear view of the object."""
        sighting = self.app.table.objects.get(self._held)
        if self.app.for_s < self.app.options.settle_s:
            return None
        if sighting is not None and sighting.at_rest and sighting.time_s > self.app.goal_client.started_s:
            self._observations.append((self._corner, sighting))
            return self._next_corner()
        if self.app.for_s > 2 * self.app.options.settle_s:
            self._start_again(f"I do not see {self._held} at {cm(self._corner)}")
        return None

    def _next_corner(self) -> ApplicationStage.Stage | None:
        if len(self._observations) == len(self.app.options.corners):
            return self._finish()
        self._relocate(self._observations[-1][0])
        return None

    def _relocate(self, source: Place) -> None:
        client, attempt = self.app.goal_client, 1 + self._missed
        ends = client.position(source), client.position(self._corner)
        client.start(RelocationGoal.KIND_RELOCATE, self.app.now_s, self._held, *ends, attempt=attempt)
        self._missed = 0
        self.app.go("placing")

    def _finish(self) -> ApplicationStage.Stage | None:
        image = [(sighting.u_px, sighting.v_px) for _, sighting in self._observations]
        plane = [place for place, _ in self._observations]
        try:
            options = self.app.options
            homography = PlaneHomography.fit(image, plane, options.grasp_z, options.frame, self._held)
        except HomographyError as error:
            self._observations = []
            self._start_again(str(error))
            return None
        self.app.outgoing.calibrations.append(homography.to_message(round(self.app.now_s * 1e9)))
        self.app.speak("Now I know where I see what I can reach.")
        return ApplicationStage.STAGE_LEARN
