"""Operator: arms the safety gate of an emulated robot once at the start. With `real: true` it refuses to start.

Subscribes  arm/safety              SafetyState   15 Hz, latched
Publishes   operator/arm_at_start   ArmRequest    until armed, latched
"""

from pydantic import field_validator

from paramove.bus import Bus, NodeConfig, is_first_start, main, topics
from paramove.operator import REAL_ROBOT, Operator

SUBSCRIBES = (topics.ARM_SAFETY,)
PUBLISHES = (topics.OPERATOR_ARM_AT_START,)


class Config(NodeConfig):
    """`arms_at_start`: arm in a person's place, for simulation. `real`: the robot is a real one."""

    arms_at_start: bool = False
    real: bool = False

    @field_validator("real")
    @classmethod
    def _a_person_arms_a_real_robot(cls, real: bool) -> bool:
        if real:
            raise ValueError(REAL_ROBOT)
        return real


def run(bus: Bus, config: Config) -> None:
    """Loop until the bus closes."""
    operator = Operator(config.arms_at_start, config.arms_at_start and not is_first_start())
    bus.ready(operator.detail)
    for received in bus.latest(topics.ARM_SAFETY):
        request = operator.update(received.message, bus.now_ns)
        if request is not None:
            bus.publish(topics.OPERATOR_ARM_AT_START, request)


if __name__ == "__main__":
    main(run, SUBSCRIBES, PUBLISHES, Config)
