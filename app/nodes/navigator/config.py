"""What the navigator can be told."""

from dataclasses import dataclass, field

from app.messages.keys import check_prefix
from ippon.mission.config import MissionConfig
from ippon.robot import ZED, RobotProfile
from ippon.vocabulary import MATTERPORT_40


@dataclass(frozen=True, slots=True, kw_only=True)
class NavigatorConfig:
    """Where it listens, for which robot, and how it searches."""

    listen: str = "tcp/127.0.0.1:7447"
    """zenoh endpoint that robot, console and requesters connect to."""
    robot: str = "ippon"
    """Key prefix of the robot."""
    profile: RobotProfile = ZED
    mission: MissionConfig = field(default_factory=MissionConfig)
    labels: tuple[str, ...] = MATTERPORT_40
    """Common objects that the segmentation is asked to tell apart."""
    language_model: str = ""
    """Name of the language model that is asked for levels, as the operator sees it; empty for none.
    It stands here to be recorded; its key does not."""
    look_every_s: float = 0.0
    """How often the language model is shown the camera image and may add common objects that it
    sees; 0 never shows it any."""
    seed: int = 0
    """Of the planner's samples."""
    command_hz: float = 30.0
    """Rate of the command stream: a robot hears something every 33 ms, whatever planning takes."""
    stale_s: float = 0.5
    """A command is repeated for at most this long after the frame that it answers."""
    lost_s: float = 1.0
    """A stream that is silent for longer counts as lost."""
    heatmap_lost_s: float = 3.0
    """The segmentation, slower than a camera, counts as lost when it is silent for longer."""
    keyframe_every_s: float = 10.0
    """How often the whole map is published for those who record."""
    hold_find_s: float = 5.0
    """A find stays in view for so long, for the operator to confirm or reject it, before the next
    goal that waits begins; longer leaves more time and holds up the queue."""
    max_queue: int = 20
    """Goals that may wait."""
    keep_map: str = ""
    """File that map and goals are kept in from one start to the next; empty keeps nothing."""

    def __post_init__(self) -> None:
        """Refuse a prefix that is none."""
        check_prefix(self.robot)
