"""A program of ROS 2 that knows nothing of paramove: what it receives, it prints as lines of JSON.

It waits for joint states of an arm that may move, sends the hand to a place, waits for the end of that, stops the arm,
and waits until the diagnostics report so. With `--leave` it ends once the arm moves.
"""

import json
import sys
import time

import rclpy
from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseStamped
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, String

FRAME, PLACE = sys.argv[1], [float(word) for word in sys.argv[2:5]]


def report(line):
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main():
    rclpy.init()
    node = rclpy.create_node("foreign")
    received = {"joint_states": [], "diagnostics": [], "goal_status": []}
    node.create_subscription(JointState, "/joint_states", received["joint_states"].append, 100)
    node.create_subscription(DiagnosticArray, "/diagnostics", received["diagnostics"].append, 10)
    node.create_subscription(String, "/goal_status", received["goal_status"].append, 10)
    goals = node.create_publisher(PoseStamped, "/goal_pose", 10)
    stops = node.create_publisher(Empty, "/stop", 10)

    def until(condition, seconds):
        end_s = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < end_s, {name: str(messages[-1:])[:2000] for name, messages in received.items()}
            rclpy.spin_once(node, timeout_sec=0.1)

    def gate():
        statuses = [one for message in received["diagnostics"][-1:] for one in message.status]
        return next((one for one in statuses if one.name == "arm/safety"), None)

    until(lambda: gate() is not None and gate().message == "ARMED", 120)
    first = received["joint_states"][0]
    age = node.get_clock().now() - Time.from_msg(first.header.stamp)
    report(json.dumps({"joints": list(first.name), "positions": list(first.position), "age_s": 1e-9 * age.nanoseconds}))

    goal = PoseStamped()
    goal.header.frame_id = FRAME
    goal.pose.position.x, goal.pose.position.y, goal.pose.position.z = PLACE
    until(lambda: goals.get_subscription_count() > 0, 10)
    goals.publish(goal)
    if "--leave" in sys.argv:
        begin = received["joint_states"][-1].position
        until(
            lambda: max(abs(a - b) for a, b in zip(begin, received["joint_states"][-1].position, strict=True)) > 0.1, 30
        )
        rclpy.shutdown()
        return
    until(lambda: received["goal_status"], 120)
    report(received["goal_status"][0].data)

    stops.publish(Empty())
    until(lambda: gate().message in ("STOPPING", "HOLD"), 5)
    report(json.dumps({"gate": gate().message, "faults": {one.key: one.value for one in gate().values}}))
    count = len(received["joint_states"])
    report(json.dumps({"joint_states": count}))
    rclpy.shutdown()


if __name__ == "__main__":
    main()
