"""Where the frame of a recording's poses lies in the frame of its map, over time."""

from bisect import bisect_right

import msgspec
import numpy as np

from app.messages import keys
from app.messages.control import decode
from app.messages.memory import MapAlignment
from app.recording.reading.recording import RecordedMessage, Recording
from ippon.geometry import Float64Array


class MapAlignments:
    """The alignments of one recording; without any, its poses are those in the map.

    A navigator has one alignment as long as it runs, which it tells a recorder a little after its
    first poses: the first one applies to what is before it, too.
    """

    def __init__(self, recording: Recording) -> None:
        """Read them; undecodable ones are skipped."""
        self._times_ns: list[int] = []
        self._T_map_world: list[Float64Array] = []
        for message in recording.all_messages((keys.MAP_ALIGNMENT,)):
            try:
                aligned = decode(message.payload, MapAlignment)
            except msgspec.DecodeError:
                continue
            self._times_ns.append(message.time_ns)
            self._T_map_world.append(aligned.as_transform())

    def at(self, time_ns: int) -> Float64Array:
        """Return T_map_world (4, 4) at a time of the recording, nanoseconds."""
        if not self._times_ns:
            return np.eye(4)
        return self._T_map_world[max(0, bisect_right(self._times_ns, time_ns) - 1)]


def alignment_message(recording: Recording, time_ns: int) -> RecordedMessage | None:
    """Return the message of the alignment that applies at a time, None without any."""
    last = recording.latest(keys.MAP_ALIGNMENT, time_ns)
    return recording.first(keys.MAP_ALIGNMENT) if last is None else last
