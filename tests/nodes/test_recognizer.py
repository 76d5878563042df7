from numpy.testing import assert_allclose

from nodes import recognizer
from paramove.bus import topics
from paramove.demonstrations import table_place
from paramove.msgs.gesture_pb2 import Gesture
from paramove.msgs.plane_calibration_pb2 import PlaneCalibration
from tests.nodes.recorded_bus import PERIOD_NS, bus_that_heard
from tests.objects.tracks import image_of, standing
from tests.pointing.persons import performed, poses


def test_says_gestures_with_places_once_calibrated() -> None:
    metres = PlaneCalibration(plane_frame="right_shoulder", plane_from_image=[0.001, 0, 0, 0, -0.001, 0, 0, 0, 1])
    recorded = [(topics.CALIBRATION_PLANE, metres)]
    recorded += [(topics.OBJECTS_TRACKED, image_of((n + 2) * PERIOD_NS, standing("blue", 200, 150))) for n in range(12)]
    bus = bus_that_heard(recorded)
    recognizer.run(bus, recognizer.Config())
    assert len(bus.published) == 1
    said = bus.published[0]
    gesture = said.message
    assert said.topic is topics.GESTURES
    assert (gesture.kind, gesture.object, gesture.located) == (Gesture.KIND_APPEARED, "blue", True)
    assert gesture.captured.ToNanoseconds() == said.captured_ns
    assert_allclose((gesture.x, gesture.y), (0.2, -0.15), rtol=0, atol=1e-9)


def test_a_bad_calibration_is_refused_and_the_node_goes_on() -> None:
    recorded = [(topics.CALIBRATION_PLANE, PlaneCalibration(plane_from_image=[1.0] * 4))]
    recorded += [(topics.OBJECTS_TRACKED, image_of((n + 2) * PERIOD_NS, standing("blue", 200, 150))) for n in range(12)]
    bus = bus_that_heard(recorded)
    recognizer.run(bus, recognizer.Config())
    assert bus.states[-1][0] == "degraded"
    assert [said.message.located for said in bus.published] == [False]


def test_says_where_arm_poses_point_and_shows_it() -> None:
    recorded = [(topics.HUMAN_ARM_POSE, pose) for pose in poses(performed("pointing", [(0.4, 0.5)]))]
    bus = bus_that_heard(recorded)
    recognizer.run(bus, recognizer.Config(pointing_from="poses"))
    (said,) = [one for one in bus.published if one.topic is topics.GESTURES]
    assert said.message.kind == Gesture.KIND_POINTED_AT
    assert_allclose((said.message.x, said.message.y), table_place((0.4, 0.5))[:2], rtol=0, atol=0.04)
    balls = [one.message for one in bus.published if one.topic is topics.GESTURES_SCENE]
    assert len(balls) > 20
    assert all(len(ball.entities[0].spheres) == 1 for ball in balls)


def test_arm_poses_say_nothing_unless_asked() -> None:
    recorded = [(topics.HUMAN_ARM_POSE, pose) for pose in poses(performed("pointing", [(0.4, 0.5)]))]
    bus = bus_that_heard(recorded)
    recognizer.run(bus, recognizer.Config())
    assert bus.published == []
