"""A robot's own navigation in ROS 2: the action NavigateToPose, or a topic; run by ROS 2's Python.

The wheels are in the test: each goal goes out on `robot/goal` over zenoh, `robot/result` ends it
("reached" or "failed"), and the x of a cancelled one is said on `robot/cancelled`. As Nav2 does, it
gives up its goal when it accepts another. By x, a goal is refused (over 50), accepted only after
7 s (over 40), or cancelled only at the second request (over 30).
"""

import faulthandler
import json
import signal
import sys
import threading
import time

import rclpy
import rclpy.signals
import zenoh
from geometry_msgs.msg import PoseStamped
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.serialization import serialize_message


class ForgetfulServer(ActionServer):
    """Loses as many requests to cancel as it is told."""

    to_lose = 0

    async def _execute_cancel_request(self, request):
        if self.to_lose > 0:
            self.to_lose -= 1
            return
        await super()._execute_cancel_request(request)


class Server:
    def __init__(self, node, session, options):
        self._session = session
        self._result = threading.Event()
        self._text = ""
        self._present = None
        self._cancels = options.get("cancels", True)
        session.declare_subscriber("robot/result", self._on_result)
        from nav2_msgs.action import NavigateToPose

        self._action = NavigateToPose
        self._server = ForgetfulServer(
            node, NavigateToPose, options["action"], self._execute,
            goal_callback=self._accept, cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )  # fmt: skip

    def _accept(self, goal):
        x = goal.pose.pose.position.x
        if x > 50.0:
            return GoalResponse.REJECT
        if x > 40.0:
            time.sleep(7.0)
        self._server.to_lose = 1 if 30.0 < x < 40.0 else 0
        return GoalResponse.ACCEPT

    def _on_result(self, sample):
        self._text = sample.payload.to_string()
        self._result.set()

    def _execute(self, handle):
        self._present = handle
        self._result.clear()
        self._session.put("robot/goal", serialize_message(handle.request.pose))
        feedback = self._action.Feedback()
        while not self._result.wait(0.02):
            if handle is not self._present:
                handle.abort()
                return self._action.Result()
            if handle.is_cancel_requested:
                handle.canceled()
                self._session.put("robot/cancelled", f"{handle.request.pose.pose.position.x}")
                return self._action.Result()
            handle.publish_feedback(feedback)
        result = self._action.Result()
        if self._text == "reached":
            handle.succeed()
        else:
            result.error_code, result.error_msg = 208, "no valid path"
            handle.abort()
        return result


def main():
    options = json.loads(sys.argv[1])
    config = zenoh.Config()
    for key, value in {
        "mode": "client",
        "connect/endpoints": [options["connect"]],
        "scouting/multicast/enabled": False,
    }.items():
        config.insert_json5(key, json.dumps(value))
    session = zenoh.open(config)
    # With the handlers of rclpy an interrupted executor goes on at times.
    rclpy.init(signal_handler_options=rclpy.signals.SignalHandlerOptions.NO)
    interrupted = threading.Event()
    signal.signal(signal.SIGINT, lambda *_: interrupted.set())
    node = rclpy.create_node("navigation")
    if "topic" in options:

        def take(message):
            session.put("robot/goal", serialize_message(message))

        node.create_subscription(PoseStamped, options["topic"], take, 10)
    else:
        server = Server(node, session, options)
        assert server is not None
        # Once its executor seemed to miss that a goal was to be executed, until the next one.
        node.create_timer(1.0, lambda: None)
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    executor = MultiThreadedExecutor(4)
    executor.add_node(node)
    threading.Thread(target=executor.spin, daemon=True).start()
    interrupted.wait()
    # The middleware hangs at times as it ends, as `ippon_ros2.__main__` says.
    faulthandler.dump_traceback_later(5.0, exit=True)
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
