"""Dashboard: shows the running application on a page in the browser, on this machine only, with a stop button.

Subscribes  camera/image, objects/tracked, gestures, calibration/plane, rules, application/stage, speech,
            relocation/goal, relocation/status, arm/joint_states, arm/safety, action/outline, action/estimate,
            every node's status; in all namespaces
Publishes   operator/stop   StopRequest   when a person presses stop
"""

from pydantic import Field

from paramove.bus import Bus, NodeConfig, Received, main, topics
from paramove.dashboard import LivePicture, PageServer, StopButton, Texts, subscribe_to_nodes
from paramove.robots import RobotDescription, RobotFolder, SurfaceParameters

PERCEPTION = (topics.CAMERA_IMAGE, topics.OBJECTS_TRACKED, topics.GESTURES, topics.CALIBRATION_PLANE)
DECISION = (topics.RULES, topics.APPLICATION_STAGE, topics.SPEECH, topics.RELOCATION_GOAL, topics.RELOCATION_STATUS)
ARM = (topics.ARM_JOINT_STATES, topics.ARM_SAFETY, topics.ACTION_OUTLINE, topics.ACTION_ESTIMATE)
SUBSCRIBES = (*PERCEPTION, *DECISION, *ARM)
PUBLISHES = (topics.OPERATOR_STOP,)


class Config(NodeConfig):
    """`port`: 0 takes a free one. `robot`: folder of its description; without one there is no stop button."""

    title: str = Field("paramove", max_length=80)
    port: int = Field(0, ge=0, le=65535)
    robot: RobotFolder | None = None
    surface: SurfaceParameters = SurfaceParameters()
    texts: Texts = Texts()


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes, or a person's stop has brought the arm to rest."""
    robot = None if config.robot is None else RobotDescription.load(config.robot)
    settings = bus.settings
    has_arms = bool(settings.namespaces)
    picture = LivePicture(
        robot, config.title, config.surface, config.texts, begun_ns=settings.begun_ns, has_arms=has_arms
    )
    with PageServer(bus.run_folder, config.port) as page:
        button = StopButton(page.was_pressed, lambda request: bus.publish(topics.OPERATOR_STOP, request))
        bus.when_readable(page.pressed, lambda: button.look(bus.now_ns))
        bus.ready(f"page on port {page.port} of this machine")
        for event in bus.events(tick=True):
            if isinstance(event, Received):
                picture.handle(event)
                button.handle(event)
                continue
            subscribe_to_nodes(bus)
            button.look(event.now_ns)
            page.show(picture.changes(event.now_ns, button.section()), picture.image())
            if button.is_over(event.now_ns):
                page.say_farewell(button.detail)
                bus.ended(button.detail)
                return


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config, visitor=True, every_namespace=True)
