"""A stand-in for a robot whose nodes have rmw_zenoh; it shares no code with what it tests.

Keys, tokens and attachments follow the examples of rmw_zenoh's design document, publishers and
subscriptions are declared as it declares them: advanced ones of zenoh, with a cache for transient
local topics. A message without a valid attachment is dropped.
"""

import struct
import threading
import time

import zenoh
import zenoh.ext

HASHES = {
    "sensor_msgs::msg::dds_::Image_": (
        "RIHS01_d31d41a9a4c4bc8eae9be757b0beed306564f7526c88ea6a4588fb9582527d47"
    ),
    "sensor_msgs::msg::dds_::CompressedImage_": (
        "RIHS01_15640771531571185e2efc8a100baf923961a4d15d5569652e6cb6691e8e371a"
    ),
    "sensor_msgs::msg::dds_::CameraInfo_": (
        "RIHS01_b3dfd68ff46c9d56c80fd3bd4ed22c7a4ddce8c8348f2f59c299e73118e7e275"
    ),
    "tf2_msgs::msg::dds_::TFMessage_": (
        "RIHS01_e369d0f05a23ae52508854b66f6aa0437f3449d652e8cbf22d5abe85d020f087"
    ),
    "geometry_msgs::msg::dds_::Twist_": (
        "RIHS01_9c45bf16fe0983d80e3cfe750d6835843d265a9a6c46bd2e609fcddde6fb8d2a"
    ),
    "geometry_msgs::msg::dds_::TwistStamped_": (
        "RIHS01_5f0fcd4f81d5d06ad9b4c4c63e3ea51b82d6ae4d0558f1d475229b1121db6f64"
    ),
    "geometry_msgs::msg::dds_::PoseStamped_": (
        "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"
    ),
    "std_msgs::msg::dds_::Float64_": (
        "RIHS01_705ba9c3d1a09df43737eb67095534de36fd426c0587779bda2bc51fe790182a"
    ),
    "trajectory_msgs::msg::dds_::JointTrajectory_": (
        "RIHS01_179b33eba59d676f6d967ac71fe35e7ca2f64b2f3928f4a018cec115e213796e"
    ),
}
"""As the packages of ROS 2 Kilted have them; a constant for tf2_msgs, which is not on PyPI."""
RELIABLE, SENSOR, LATCHED = "::,10:,:,:,,", "2::,5:,:,:,,", ":1:,1:,:,:,,"


class Received:
    """Messages of a subscription, with their attachments."""

    def __init__(self):
        self.messages = []
        self._changed = threading.Condition()

    def add(self, payload, attachment):
        with self._changed:
            self.messages.append((payload, attachment))
            self._changed.notify_all()

    def wait_for(self, test, timeout_s=20.0):
        """Return the messages as soon as a test of them holds."""
        with self._changed:
            assert self._changed.wait_for(lambda: test(self.messages), timeout_s), self.messages
            return list(self.messages)


class RmwRobot:
    """One node with publishers and subscriptions.

    Args:
        session: zenoh session of the node.
        domain: ROS domain.
        humble: Keys have no hash.
    """

    def __init__(self, session, domain=0, node="scout", humble=False):
        self.session, self.domain, self.humble = session, domain, humble
        self._node = f"@ros2_lv/{domain}/{session.zid()}/0/"
        self._name = f"%/%/{node}"
        self._count = 0
        self.tokens = [self._declare(f"{self._node}0/NN/{self._name}")]
        self.graph = set()
        self._changed = threading.Condition()
        self._watch = session.liveliness().declare_subscriber(
            f"@ros2_lv/{domain}/**", self._see, history=True
        )

    def publisher(self, topic, dds_type, qos=RELIABLE, type_hash=None):
        """Declare a publisher; return what publishes a payload."""
        key, gid = self._endpoint("MP", topic, dds_type, qos, type_hash)
        options = {"congestion_control": zenoh.CongestionControl.DROP}
        if qos.split(":")[1] == "1":
            options |= {
                "cache": zenoh.ext.CacheConfig(max_samples=1),
                "publisher_detection": True,
                "sample_miss_detection": zenoh.ext.MissDetectionConfig(
                    heartbeat=None, sporadic_heartbeat=0.5
                ),
            }
        publisher = zenoh.ext.declare_advanced_publisher(self.session, key, **options)
        numbers = iter(range(1, 1_000_000))

        def put(payload):
            attachment = struct.pack("<qqB16s", next(numbers), time.time_ns(), 16, gid)
            publisher.put(payload, attachment=attachment)

        put.declared, put.numbers = publisher, numbers
        return put

    def subscription(self, topic, dds_type, qos=RELIABLE, type_hash=None, hear=None):
        """Declare a subscription; return what it receives, and pass each payload to `hear`."""
        received = Received()

        def take(sample):
            if sample.attachment is None or len(sample.attachment.to_bytes()) != 33:
                return
            number, stamp_ns, length, gid = struct.unpack("<qqB16s", sample.attachment.to_bytes())
            assert length == 16
            received.add(sample.payload.to_bytes(), (number, stamp_ns, gid))
            if hear is not None:
                hear(sample.payload.to_bytes())

        # As in rmw_zenoh, the token comes last: who sees it can send.
        key = self._key(topic, dds_type, type_hash or self._usual_hash(dds_type))
        self.tokens.append(zenoh.ext.declare_advanced_subscriber(self.session, key, take))
        self._endpoint("MS", topic, dds_type, qos, type_hash)
        return received

    def sees(self, part, timeout_s=20.0):
        """Wait until the graph has a token with these characters; return it."""
        with self._changed:
            there = lambda: next((t for t in self.graph if part in t), None)  # noqa: E731
            assert self._changed.wait_for(there, timeout_s), (part, self.graph)
            return there()

    def misses(self, part, timeout_s=20.0):
        """Wait until the graph has no token with these characters."""
        with self._changed:
            assert self._changed.wait_for(
                lambda: not any(part in token for token in self.graph), timeout_s
            )

    def _endpoint(self, kind, topic, dds_type, qos, type_hash):
        self._count += 1
        type_hash = type_hash or self._usual_hash(dds_type)
        mangled = topic.replace("/", "%")
        token = (
            f"{self._node}{self._count}/{kind}/{self._name}/{mangled}/{dds_type}/{type_hash}/{qos}"
        )
        self.tokens.append(self._declare(token))
        return self._key(topic, dds_type, type_hash), bytes([self._count] * 16)

    def _key(self, topic, dds_type, type_hash):
        return f"{self.domain}{topic}/{dds_type}/{type_hash}"

    def _usual_hash(self, dds_type):
        return "TypeHashNotSupported" if self.humble else HASHES[dds_type]

    def _declare(self, token):
        return self.session.liveliness().declare_token(token)

    def _see(self, sample):
        with self._changed:
            change = self.graph.add if sample.kind == zenoh.SampleKind.PUT else self.graph.discard
            change(str(sample.key_expr))
            self._changed.notify_all()


class ActionServer:
    """Nav2's action NavigateToPose of a robot: three services; a test decides about each goal.

    `accepts` answers the next goal; `finish` ends the last one with a status, 4 reached, 5
    cancelled, 6 failed, and an error code.
    """

    def __init__(self, robot, name, type_hash="RIHS01_" + "cd" * 32):
        self.accepts = True
        self.silent = 0
        """Requests to take or cancel a goal that are carried out without an answer."""
        self.goals, self.cancelled, self.attachments = Received(), Received(), []
        self.confirmed = Received()
        """Goals whose cancelling was answered."""
        self.cleared = Received()
        """Requests to cancel all goals."""
        self._result = None
        self._queryables = []
        under = f"{robot.domain}{name}/_action"
        mangled = f"{name}/_action".replace("/", "%")
        for service, dds_type, answer in (
            ("send_goal", "nav2_msgs::action::dds_::NavigateToPose_SendGoal_", self._take),
            ("get_result", "nav2_msgs::action::dds_::NavigateToPose_GetResult_", self._keep),
            ("cancel_goal", "action_msgs::srv::dds_::CancelGoal_", self._cancel),
        ):
            robot._count += 1
            robot.tokens.append(
                robot._declare(
                    f"{robot._node}{robot._count}/SS/{robot._name}/{mangled}%{service}/"
                    f"{dds_type}/{type_hash}/{RELIABLE}"
                )
            )
            key = f"{under}/{service}/{dds_type}/{type_hash}"
            self._queryables.append(robot.session.declare_queryable(key, answer, complete=True))

    def finish(self, status, code=0):
        """End the last goal."""
        self.finish_query(self.take_result(), status, code)

    def take_result(self):
        """Return the request for the last goal's end, which `finish_query` answers."""
        query, self._result = self._result, None
        return query

    def finish_query(self, query, status, code=0):
        """End the goal of a request."""
        payload = struct.pack("<4sbxHI1s", b"\0\1\0\0", status, code, 1, b"\0")
        query.reply(query.key_expr, payload, attachment=query.attachment.to_bytes())
        query.drop()

    def has_result(self):
        return self._result is not None

    def _take(self, query):
        assert len(query.attachment.to_bytes()) == 33
        payload = query.payload.to_bytes()
        number, pose, tail = payload[4:20], payload[:4] + payload[20:-5], payload[-5:]
        assert tail == struct.pack("<I", 1) + b"\0", "no behavior tree"
        answer = struct.pack("<4s?3xiI", b"\0\1\0\0", self.accepts, 0, 0)
        # First, as the reply may bring the request for the result at once.
        self.goals.add(pose, number)
        self._reply(query, answer)

    def _keep(self, query):
        self._result = query

    def _cancel(self, query):
        payload = query.payload.to_bytes()
        answer = struct.pack("<4sb3xI", b"\0\1\0\0", 0, 0)
        if payload[4:] == bytes(24):  # Neither number nor time.
            self.cleared.add(payload, None)
        else:
            self.cancelled.add(payload[4:20], None)
        if self._reply(query, answer):
            self.confirmed.add(payload[4:20], None)

    def _reply(self, query, answer):
        answers = not self.silent
        if answers:
            query.reply(query.key_expr, answer, attachment=query.attachment.to_bytes())
        else:
            self.silent -= 1
        query.drop()
        return answers
