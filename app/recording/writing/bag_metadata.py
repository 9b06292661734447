"""`metadata.yaml` of a rosbag2 folder."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

import yaml

from app.recording.channels import Topic, quality_of_service
from ippon.atomic_file import replace_file

FILE_NAME: Final = "metadata.yaml"
_VERSION: Final = 9


def write_bag_metadata(
    folder: Path, file_name: str, counts: Mapping[Topic, int], start_ns: int, end_ns: int
) -> None:
    """Write the metadata file that `ros2 bag` needs.

    Args:
        folder: The session.
        file_name: Name of the MCAP file in it.
        counts: Messages of each topic.
        start_ns: Time of the first message, nanoseconds since 1970.
        end_ns: Time of the last message.
    """
    total = sum(counts.values())
    span = {
        "starting_time": {"nanoseconds_since_epoch": start_ns},
        "duration": {"nanoseconds": max(0, end_ns - start_ns)},
        "message_count": total,
    }
    content: dict[str, Any] = {
        "version": _VERSION,
        "storage_identifier": "mcap",
        **span,
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.name,
                    "type": topic.type,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": [quality_of_service(topic)],
                    "type_description_hash": topic.type_hash,
                },
                "message_count": count,
            }
            for topic, count in counts.items()
        ],
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file_name],
        "files": [{"path": file_name, **span}],
        "custom_data": None,
        "ros_distro": "jazzy",
    }
    text = yaml.safe_dump({"rosbag2_bagfile_information": content}, sort_keys=False)
    replace_file(folder / FILE_NAME, text.encode())
