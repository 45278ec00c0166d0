"""Every topic, service and action of the graph, once: name, type, quality of service, who publishes, who listens.

Names are relative, so a namespace holds a whole robot. `/clock` alone is shared by all.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import BatteryState, CameraInfo, CompressedImage, Image, Imu, JointState
from std_msgs.msg import String
from std_srvs.srv import Trigger
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import MarkerArray

from tulip_msgs.action import Kick
from tulip_msgs.msg import (
    BehaviourTree,
    Decision,
    EmergencyStop,
    Features,
    FootForces,
    GameState,
    GroundTruth,
    HeadCommand,
    JointCommand,
    MotionState,
    UserCommand,
    WalkCommand,
    WorldState,
)
from tulip_msgs.srv import PlaceBall, Push, Reset, SetUserCommand, StartRecording, StopRecording


@dataclass(frozen=True)
class Quality:
    """Quality of service.

    Attributes:
        depth: How many messages wait for a slow listener; older ones are dropped.
        latched: The last message also reaches listeners that come later.
    """

    depth: int
    latched: bool = False

    @property
    def on_looking(self) -> ReliabilityPolicy:
        """For who only looks: no publisher repeats a message for it. Latched ones reach reliable listeners alone."""
        return ReliabilityPolicy.RELIABLE if self.latched else ReliabilityPolicy.BEST_EFFORT

    def profile(self, reliability: ReliabilityPolicy = ReliabilityPolicy.RELIABLE) -> QoSProfile:
        """Return the profile for rclpy: keep last, and reliable unless asked otherwise."""
        return QoSProfile(
            history=HistoryPolicy.KEEP_LAST,
            depth=self.depth,
            reliability=reliability,
            durability=DurabilityPolicy.TRANSIENT_LOCAL if self.latched else DurabilityPolicy.VOLATILE,
        )

    def __str__(self) -> str:
        return f"reliable, last {self.depth}" + (", latched" if self.latched else "")


CONTROL = Quality(depth=5)  # a command or state that the next one replaces; 5 bridge 20 ms at 250 Hz
PICTURE = Quality(depth=2)  # 0.9 MB each: a slow listener sees the newest pictures instead of old ones
STATE = Quality(depth=10)
LATCHED = Quality(depth=1, latched=True)
EVENTS = Quality(depth=50)  # from many senders at once


@dataclass(frozen=True)
class Topic:
    """One topic.

    Attributes:
        name: Relative name ("/clock" alone is absolute).
        message: Class of the message.
        quality: Quality of service, of publishers and subscribers alike.
        publishers: Names of the nodes that publish it.
        subscribers: Names of the nodes that listen, without tools (recorder, viewers).
        meaning: What it carries.
        rate: How often it comes while a robot plays [1/s], in the graph's time; 0 for one that comes on events.
        missed_after: Without it for so long [s], its listeners miss it (see `tulip_ros.watches`); 0: they never do.
    """

    name: str
    message: type[Any]
    quality: Quality
    publishers: tuple[str, ...]
    subscribers: tuple[str, ...]
    meaning: str
    rate: float = 0.0
    missed_after: float = 0.0

    @property
    def type_name(self) -> str:
        """The type as ROS writes it: package/msg/Name."""
        return type_name(self.message)

    def within(self, namespace: str) -> Topic:
        """Return this topic in a robot's namespace, for a node outside it; "" changes nothing, nor what all share."""
        return replace(self, name=f"{namespace}/{self.name}") if namespace and self.name[0] != "/" else self

    def publish_from(self, node: Node) -> Publisher:
        """Create this topic's publisher in a node."""
        return node.create_publisher(self.message, self.name, self.quality.profile())

    def subscribe_from(
        self,
        node: Node,
        callback: Callable[[Any], None],
        raw: bool = False,
        depth: int | None = None,
        only_looks: bool = False,
    ) -> Subscription:
        """Create a subscription to this topic in a node.

        Args:
            node: The node.
            callback: Is given each message.
            raw: Give the callback the serialized message (bytes) instead.
            depth: How many messages wait for this listener; as many as for any other by default.
            only_looks: The listener rather misses a message than has its sender repeat it.
        """
        quality = self.quality if depth is None else replace(self.quality, depth=depth)
        profile = quality.profile(quality.on_looking) if only_looks else quality.profile()
        return node.create_subscription(self.message, self.name, callback, profile, raw=raw)


@dataclass(frozen=True)
class Service:
    """One service or action: relative name, type, the node that serves it and what it does."""

    name: str
    type: type[Any]
    server: str
    meaning: str

    @property
    def type_name(self) -> str:
        """The type as ROS writes it: package/srv/Name or package/action/Name."""
        return type_name(self.type)


def type_name(interface: type[Any]) -> str:
    """Return the name of a message, service or action class as ROS writes it, as in sensor_msgs/msg/Image."""
    package, kind, *_ = interface.__module__.split(".")
    return f"{package}/{kind}/{interface.__name__}"


ALL_NODES = ("driver", "vision", "worldmodel", "head", "motion", "strategy", "game_input", "user_input")
OBEYING = ("driver", "head", "motion", "strategy", "user_input", "identify")
"""Nodes that obey the emergency stop: all that move the robot or decide what it does."""

CAMERA_IMAGE = Topic(
    "camera/image_raw",
    Image,
    PICTURE,
    ("driver",),
    ("vision",),
    "picture of the head camera, bgr8, distorted",
    rate=15.6,
    missed_after=0.5,
)
CAMERA_COMPRESSED = Topic(
    "camera/image_raw/compressed",
    CompressedImage,
    PICTURE,
    ("driver",),
    (),
    "the same as JPEG, for recordings and viewers; sent while someone listens",
)
CAMERA_INFO = Topic("camera/camera_info", CameraInfo, LATCHED, ("driver",), ("vision",), "lens of the head camera")
JOINT_STATES = Topic(
    "joint_states",
    JointState,
    CONTROL,
    ("driver",),
    ("motion", "head", "vision", "perception"),
    "14 joints: [rad], [rad/s], [N m]",
    rate=250,
    missed_after=0.1,
)
IMU = Topic(
    "imu", Imu, CONTROL, ("driver",), ("motion",), "inertial unit in the trunk, in imu_link", rate=250, missed_after=0.1
)
FOOT_FORCES = Topic(
    "foot_forces",
    FootForces,
    CONTROL,
    ("driver",),
    ("motion",),
    "four force cells a foot and the CoP",
    rate=250,
    missed_after=0.1,
)
BATTERY = Topic("battery_state", BatteryState, STATE, ("driver",), (), "once a second, from bodies that know it")
LEG_COMMAND = Topic(
    "legs/joint_command",
    JointCommand,
    CONTROL,
    ("motion",),
    ("driver",),
    "to the 12 leg joints",
    rate=250,
    # not missed_after: the driver tells of commands that outlived their time-to-live
)
HEAD_JOINT_COMMAND = Topic(
    "head/joint_command",
    JointCommand,
    CONTROL,
    ("head",),
    ("driver",),
    "to head_pan and head_tilt",
    rate=50,
)
FEATURES = Topic(
    "features",
    Features,
    STATE,
    ("vision", "perception"),
    ("worldmodel",),
    "features of one picture, two angles each",
    rate=15.6,
    missed_after=0.5,
)
VISION_PICTURE = Topic("vision/picture", Image, PICTURE, ("vision",), (), "picture with the features drawn in")
ODOMETRY = Topic(
    "odometry",
    Odometry,
    CONTROL,
    ("motion",),
    ("worldmodel", "vision", "perception"),
    "dead reckoning: base_link in odom",
    rate=50,
    missed_after=0.2,
)
MOTION_STATE = Topic(
    "motion_state",
    MotionState,
    CONTROL,
    ("motion",),
    ("strategy", "game_input"),
    "everything about the legs",
    rate=50,
    missed_after=0.5,
)
FOOTSTEPS = Topic(
    "footsteps",
    PoseArray,
    STATE,
    ("motion",),
    (),
    "the walk's next footsteps, whenever they change: soles in odom, the one under way first; none while it stands",
)
WORLD_STATE = Topic(
    "world_state",
    WorldState,
    STATE,
    ("worldmodel",),
    ("strategy", "game_input"),
    "robot, ball and opponents",
    rate=50,
    missed_after=0.5,
)
ROBOT_POSE = Topic(
    "robot_pose", PoseWithCovarianceStamped, STATE, ("worldmodel",), (), "base_footprint in map, for standard viewers"
)
TF = Topic("tf", TFMessage, EVENTS, ("worldmodel", "motion"), (), "map to odom; odom to base_footprint to base_link")
EMERGENCY_STOP = Topic(
    "emergency_stop",
    EmergencyStop,
    LATCHED,
    OBEYING,
    OBEYING,
    "whether the emergency stop holds: anybody may engage it, it ends by `release_emergency_stop` alone; all who obey"
    " repeat the newest word",
)
USER_WISH = Topic(
    "user_wish",
    UserCommand,
    STATE,
    (),
    ("user_input",),
    "what a person wants, from viewers that publish; checked as set_user_command, stamp and sequence are not read",
)
GAME_STATE = Topic("game_state", GameState, LATCHED, ("game_input",), ("strategy",), "the referee's view of the game")
USER_PRESENT = Topic(
    "user_present",
    String,
    CONTROL,
    (),
    ("user_input",),
    "a face says four times a second that whoever began the walk test by it is there: without that it ends",
)
USER_COMMAND = Topic(
    "user_command", UserCommand, LATCHED, ("user_input",), ("strategy", "identify"), "the user's last wish"
)
WALK_COMMAND = Topic(
    "walk_command",
    WalkCommand,
    CONTROL,
    ("strategy",),
    ("motion",),
    "velocity or goal for the legs",
    rate=50,
    missed_after=0.5,
)
HEAD_COMMAND = Topic(
    "head_command",
    HeadCommand,
    CONTROL,
    ("strategy",),
    ("head",),
    "what the head shall look at",
    rate=50,
    missed_after=0.5,
)
DECISION = Topic("decision", Decision, STATE, ("strategy",), (), "what strategy decided and why (behaviour tree)")
BEHAVIOUR_TREE = Topic(
    "behaviour_tree",
    BehaviourTree,
    LATCHED,
    ("strategy",),
    (),
    "every node of the behaviour tree and what it says, whenever that changes",
)
ROBOT_DESCRIPTION = Topic("robot_description", String, LATCHED, ("driver",), (), "URDF of the robot, for viewers")
DIAGNOSTICS = Topic("diagnostics", DiagnosticArray, EVENTS, ALL_NODES, (), "health of each node, once a second")
DIAGNOSTICS_AGG = Topic(
    "diagnostics_agg",
    DiagnosticArray,
    STATE,
    ("aggregator",),
    (),
    "the worst of all nodes' health, then each node's; from the launcher where it started the robot",
)
MARKERS = Topic(
    "markers",
    MarkerArray,
    STATE,
    ("markers",),
    (),
    "what the robot knows and plans, to be drawn by RViz; if listened to",
)
START_POSE = Topic(
    "initialpose",
    PoseWithCovarianceStamped,
    LATCHED,
    ("driver",),
    ("worldmodel",),
    "base_footprint in map, where people have set the robot down since the first world began; viewers send it, too",
)
REPORT = Topic(
    "referee/report", String, LATCHED, ("driver",), (), "match of two robots: all that the referee has said, as JSON"
)
IDENTIFICATION = Topic(
    "identification/progress",
    String,
    LATCHED,
    ("identify",),
    (),
    "how far the experiment of `identify.py run` has come, and which readings count, as JSON",
)
GROUND_TRUTH = Topic(
    "ground_truth",
    GroundTruth,
    CONTROL,
    ("driver",),
    ("perception",),
    "what really is; no component that plays may listen",
    rate=50,
    missed_after=0.5,
)
CLOCK = Topic("/clock", Clock, Quality(depth=1), ("driver",), ALL_NODES, "time of the simulation, 50 Hz", rate=50)

TOPICS: tuple[Topic, ...] = (
    CAMERA_IMAGE,
    CAMERA_COMPRESSED,
    CAMERA_INFO,
    JOINT_STATES,
    IMU,
    FOOT_FORCES,
    BATTERY,
    LEG_COMMAND,
    HEAD_JOINT_COMMAND,
    FEATURES,
    VISION_PICTURE,
    ODOMETRY,
    MOTION_STATE,
    FOOTSTEPS,
    WORLD_STATE,
    ROBOT_POSE,
    TF,
    GAME_STATE,
    EMERGENCY_STOP,
    USER_WISH,
    USER_PRESENT,
    USER_COMMAND,
    WALK_COMMAND,
    HEAD_COMMAND,
    DECISION,
    BEHAVIOUR_TREE,
    ROBOT_DESCRIPTION,
    DIAGNOSTICS,
    DIAGNOSTICS_AGG,
    MARKERS,
    START_POSE,
    REPORT,
    IDENTIFICATION,
    GROUND_TRUTH,
    CLOCK,
)

FROM_PEOPLE: tuple[Topic, ...] = (USER_WISH, EMERGENCY_STOP, START_POSE)
"""Topics that a person's viewer may publish; all others belong to the nodes."""

RESET = Service("simulation/reset", Reset, "driver", "begin anew with a scenario and a seed")
PLACE_BALL = Service("simulation/place_ball", PlaceBall, "driver", "put the ball somewhere")
PUSH = Service("simulation/push", Push, "driver", "push the robot's trunk")
SET_USER_COMMAND = Service("set_user_command", SetUserCommand, "user_input", "tell the robot what the user wants")
START = Service("start", Trigger, "user_input", "obey the referee and play")
STOP = Service("stop", Trigger, "user_input", "stop and stand, whatever the referee says")
STAND = Service("stand", Trigger, "user_input", "stand up straight")
GO_LIMP = Service("limp", Trigger, "user_input", "legs without stiffness, until the next wish")
ENGAGE_STOP = Service(
    "engage_emergency_stop", Trigger, "user_input", "no stiffness in any joint, until the emergency stop is released"
)
RELEASE_STOP = Service(
    "release_emergency_stop", Trigger, "user_input", "end the emergency stop; the robot stays limp until the next wish"
)
START_RECORDING = Service("start_recording", StartRecording, "recorder", "begin a recording")
STOP_RECORDING = Service("stop_recording", StopRecording, "recorder", "end the recording")
PAUSE_REPLAY = Service("replay/pause", Trigger, "replay", "hold the replay; of the log driver, too")
RESUME_REPLAY = Service("replay/resume", Trigger, "replay", "go on with the replay")
STEP_REPLAY = Service("replay/step", Trigger, "replay", "hold the replay, and let one step of it pass")
BEGIN_IDENTIFICATION = Service(
    "identification/begin", Trigger, "identify", "begin the experiment, or once more after its end"
)
ABORT_IDENTIFICATION = Service(
    "identification/abort", Trigger, "identify", "end the experiment: go home, put the foot down and stand"
)
KICK = Service("kick", Kick, "motion", "action: kick the ball once, from standing or by a step of the walk")

SERVICES: tuple[Service, ...] = (
    RESET,
    PLACE_BALL,
    PUSH,
    START,
    STOP,
    STAND,
    GO_LIMP,
    ENGAGE_STOP,
    RELEASE_STOP,
    SET_USER_COMMAND,
    START_RECORDING,
    STOP_RECORDING,
    PAUSE_REPLAY,
    RESUME_REPLAY,
    STEP_REPLAY,
    BEGIN_IDENTIFICATION,
    ABORT_IDENTIFICATION,
    KICK,
)


def is_called(name: str, entry: Topic | Service) -> bool:
    """Return whether a full name, as in /striker/odometry, is that of a topic or service in some namespace."""
    return name == entry.name or name.endswith(f"/{entry.name.lstrip('/')}")


def published_by(node_name: str) -> Iterator[Topic]:
    """Yield the topics that a node publishes."""
    return (topic for topic in TOPICS if node_name in topic.publishers)


def heard_by(node_name: str) -> Iterator[Topic]:
    """Yield the topics that a node listens to."""
    return (topic for topic in TOPICS if node_name in topic.subscribers)


def markdown_tables() -> str:
    """Return the tables of topics, and of services and actions, for the documentation."""
    lines = ["| topic | type | quality of service | from | to | meaning |", "| --- | --- | --- | --- | --- | --- |"]
    for topic in TOPICS:
        senders, listeners = (
            "all nodes" if nodes == ALL_NODES else ", ".join(nodes) or "tools only"
            for nodes in (topic.publishers, topic.subscribers)
        )
        lines.append(
            f"| `{topic.name}` | {topic.type_name} | {topic.quality} | {senders} | {listeners} | {topic.meaning} |"
        )
    lines += ["", "| service or action | type | server | meaning |", "| --- | --- | --- | --- |"]
    lines += [f"| `{s.name}` | {s.type_name} | {s.server} | {s.meaning} |" for s in SERVICES]
    return "\n".join(lines) + "\n"


def markdown_graph() -> str:
    """Return the node graph as a mermaid diagram for the documentation: who tells whom what."""
    lines = ["```mermaid", "graph LR"]
    edges: dict[tuple[str, str], list[str]] = {}
    for topic in TOPICS:
        if ALL_NODES in (topic.publishers, topic.subscribers) or topic.publishers == topic.subscribers:
            continue  # these would be lines from everybody to everybody
        for sender in topic.publishers:
            for listener in topic.subscribers:
                edges.setdefault((sender, listener), []).append(topic.name)
    edges.setdefault(("strategy", KICK.server), []).append(f"{KICK.name} (action)")
    for (sender, listener), names in edges.items():
        lines.append(f'    {sender} -->|"{"<br/>".join(names)}"| {listener}')
    lines += [
        '    referee(["referee program"]) -->|"UDP"| game_input',
        '    person(["menu, tools"]) --> user_input',
        "```",
    ]
    return "\n".join(lines) + "\n"
