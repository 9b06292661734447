"""Things with an identity that lasts: what the map shows now is matched to what is remembered."""

import dataclasses
import math
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass, field
from typing import Final

from ippon.guidance.language.naming import same_object
from ippon.memory.config import MemoryConfig
from ippon.memory.instance import Instance, Point, Sighting, Source, box_overlap, is_on_floor
from ippon.memory.map_clusters import ClusterChanges

_CELL_M: Final = 2.0
"""Edge of the squares that instances are looked up by; no thing reaches beyond the next square."""
_UNSEEN_PER_UPDATE: Final = 32


@dataclass(slots=True, kw_only=True)
class MemoryChanges:
    """What a file of the memory has not got yet."""

    changed: dict[int, Instance] = field(default_factory=dict[int, Instance])
    removed: set[int] = field(default_factory=set[int])


class InstanceMemory:
    """All things that are remembered; one thread changes it.

    Args:
        config: What is the same thing, and what is gone.
        instances: Remembered earlier, in the same world frame.
    """

    def __init__(
        self, config: MemoryConfig | None = None, instances: Iterable[Instance] = ()
    ) -> None:
        self.config = config or MemoryConfig()
        self._instances: dict[int, Instance] = {}
        self._cells: dict[tuple[int, int], set[int]] = {}
        self._cluster_of: dict[int, int] = {}
        self._instance_of: dict[int, int] = {}
        self._shrunk: set[int] = set()
        """Instances that show less of themselves than they did."""
        self._unseen: list[int] = []
        """Instances of the map that no cluster shows at present."""
        self._changes = MemoryChanges()
        self._shown: tuple[Instance, ...] | None = None
        for instance in instances:
            self._put(instance)
            if instance.source == "map" and not instance.is_gone:
                self._unseen.append(instance.instance_id)
        self._next = max(self._instances, default=0) + 1
        self._changes = MemoryChanges()

    def __len__(self) -> int:
        """Return the number of things, those that are gone included."""
        return len(self._instances)

    def instances(self) -> tuple[Instance, ...]:
        """Return all things, in the order in which they were first seen."""
        if self._shown is None:
            self._shown = tuple(self._instances.values())
        return self._shown

    def get(self, instance_id: int) -> Instance | None:
        """Return a thing; None where it is not remembered any more."""
        return self._instances.get(instance_id)

    def take_changes(self) -> MemoryChanges:
        """Return what changed since the last call."""
        changes, self._changes = self._changes, MemoryChanges()
        return changes

    def update(
        self,
        changes: ClusterChanges,
        now_ns: int,
        share_observed: Callable[[Sighting], float],
    ) -> tuple[Instance, ...]:
        """Match what the map shows to what is remembered.

        Args:
            changes: Of the map's clusters.
            now_ns: Nanoseconds since 1970.
            share_observed: Returns how much of a thing's box the map knows.

        Returns:
            The things that were noticed to be gone.
        """
        freed = [self._detach(k) for k in changes.replaced if k in self._instance_of]
        shown = {
            k: cluster.sighting
            for k, cluster in changes.current.items()
            if cluster.sighting is not None
        }
        waiting = [*freed, *self._unseen]
        matched = self._match(shown, waiting, now_ns)
        for number, sighting in shown.items():
            if number not in matched:
                self._add_shown(number, sighting, now_ns)
        for number in changes.seen:
            self._see_again(number, now_ns)
        left = [k for k in dict.fromkeys(waiting) if k not in self._cluster_of]
        return self._without_cluster(left, set(freed), now_ns, share_observed)

    def note_find(self, sighting: Sighting, now_ns: int, others: Collection[int] = ()) -> Instance:
        """Remember what a search found, or found again.

        Args:
            sighting: The object where the search saw it.
            now_ns: Nanoseconds since 1970.
            others: Numbers of things that it is not.
        """
        near = [
            one
            for one in self._near(sighting.position_world)
            if one.source == "search"
            and one.instance_id not in others
            and same_object(one.label, sighting.label)
            and not any(same_object(label, sighting.label) for label in one.denied)
            and math.dist(one.position_world, sighting.position_world) <= self.config.find_within_m
        ]
        if not near:
            return self._new(sighting, "search", now_ns)
        known = min(near, key=lambda k: math.dist(k.position_world, sighting.position_world))
        return self._put(_seen_now(known, sighting, now_ns))

    def mark_gone(self, instance_id: int, now_ns: int) -> Instance | None:
        """Note that a thing is not there any more; None where that was known."""
        instance = self._instances.get(instance_id)
        if instance is None or instance.is_gone:
            return None
        return self._put(dataclasses.replace(instance, gone_ns=now_ns))

    def note(self, instance_id: int, *, name: str, denied: tuple[str, ...]) -> Instance | None:
        """Keep what a person says of a thing; None where it is not remembered any more.

        Args:
            instance_id: Its number.
            name: What the person calls it; empty for nothing.
            denied: Labels that it does not have.
        """
        known = self._instances.get(instance_id)
        if known is None:
            return None
        return self._put(dataclasses.replace(known, name=name, denied=denied))

    def remove(self, instance_id: int) -> None:
        """Forget a thing: it never was what it was taken for."""
        instance = self._instances.pop(instance_id, None)
        if instance is None:
            return
        self._cells[_cell(instance.position_world)].discard(instance_id)
        self._shrunk.discard(instance_id)
        number = self._cluster_of.pop(instance_id, None)
        if number is not None:
            self._instance_of.pop(number, None)
        self._changes.changed.pop(instance_id, None)
        self._changes.removed.add(instance_id)
        self._shown = None

    def set_rooms(self, name_at: Callable[[tuple[float, float]], str], floor_z_m: float) -> None:
        """Name the rooms of all things on one floor, also of those that are gone.

        Args:
            name_at: Returns the room at a world position, empty where it is not clear.
            floor_z_m: Height of the floor whose rooms these are.
        """
        for instance in self.instances():
            if not is_on_floor(instance, floor_z_m):
                continue
            room = name_at(instance.position_world[:2])
            if room and room != instance.room:
                self._put(dataclasses.replace(instance, room=room))

    def set_view_score(self, instance_id: int, score: float) -> None:
        """Note how good the picture of a thing is."""
        instance = self._instances.get(instance_id)
        if instance is not None:
            self._put(dataclasses.replace(instance, view_score=score))

    # -- clusters ----------------------------------------------------------------------------

    def _match(self, shown: dict[int, Sighting], waiting: list[int], now_ns: int) -> dict[int, int]:
        """Give clusters to the things that they show; returns things by cluster."""
        free = set(waiting)
        pairs: list[tuple[tuple[bool, bool, float], int, int]] = []
        for number, sighting in shown.items():
            for known in self._near(sighting.position_world):
                if known.source != "map" or known.instance_id in self._cluster_of:
                    continue
                same, overlap = known.label == sighting.label, box_overlap(known, sighting)
                config = self.config
                enough = config.same_overlap if same else config.relabel_overlap
                if overlap < enough or (known.is_gone and not same):
                    continue
                rank = (same, known.instance_id in free, overlap)
                pairs.append((rank, number, known.instance_id))
        matched: dict[int, int] = {}
        for _, number, instance_id in sorted(pairs, reverse=True):
            if number in matched or instance_id in self._cluster_of:
                continue
            matched[number] = instance_id
            self._attach(instance_id, number)
            self._show(self._instances[instance_id], shown[number], now_ns)
        return matched

    def _show(self, known: Instance, sighting: Sighting, now_ns: int) -> None:
        """Update a thing by what its cluster shows now."""
        shrunk = sighting.voxels < self.config.shrink_share * known.voxels
        settling = self._is_recent(known.last_seen_ns, now_ns)
        if shrunk and settling and not known.is_gone and known.label == sighting.label:
            self._shrunk.add(known.instance_id)
            return
        self._shrunk.discard(known.instance_id)
        self._put(_seen_now(known, sighting, now_ns))

    def _add_shown(self, number: int, sighting: Sighting, now_ns: int) -> None:
        """Remember a new thing, unless its cluster is a part of one that is remembered."""
        for known in self._near(sighting.position_world):
            is_part = known.label == sighting.label and known.instance_id in self._cluster_of
            if is_part and box_overlap(known, sighting) >= self.config.relabel_overlap:
                return
        self._attach(self._new(sighting, "map", now_ns).instance_id, number)

    def _see_again(self, number: int, now_ns: int) -> None:
        known = self._instances.get(self._instance_of.get(number, 0))
        if known is None or known.instance_id in self._shrunk:
            return
        # Once in ten seconds is exact enough, and writes less.
        if not 0 <= now_ns - known.last_seen_ns <= 10_000_000_000:
            self._put(dataclasses.replace(known, last_seen_ns=now_ns))

    def _without_cluster(
        self,
        left: list[int],
        freed: set[int],
        now_ns: int,
        share_observed: Callable[[Sighting], float],
    ) -> tuple[Instance, ...]:
        """Decide on the things that no cluster shows: gone, absorbed, or out of the map."""
        gone: list[Instance] = []
        unseen: list[int] = []
        checked = 0
        for instance_id in left:
            known = self._instances.get(instance_id)
            if known is None or known.is_gone:
                continue
            checked += 1
            unchecked = instance_id not in freed and checked > _UNSEEN_PER_UPDATE
            if unchecked or share_observed(known) < self.config.gone_share:
                unseen.append(instance_id)
            elif self._is_absorbed(known) or (
                self._is_recent(known.first_seen_ns, now_ns) and not _noted(known)
            ):
                self.remove(instance_id)
            else:
                gone.append(self._put(dataclasses.replace(known, gone_ns=now_ns)))
        # Those that were not checked come first the next time.
        turn = _UNSEEN_PER_UPDATE % max(1, len(unseen))
        self._unseen = [*unseen[turn:], *unseen[:turn]]
        return tuple(gone)

    def _is_absorbed(self, known: Instance) -> bool:
        """Return whether another thing that the map shows has taken a thing's place.

        It takes over what people have said of the thing.
        """
        for other in self._near(known.position_world):
            is_other = other.instance_id in self._cluster_of and other.label == known.label
            if is_other and box_overlap(known, other) >= self.config.relabel_overlap:
                if _noted(known):
                    denied = tuple(dict.fromkeys((*other.denied, *known.denied)))
                    name = other.name or known.name
                    self._put(dataclasses.replace(other, name=name, denied=denied))
                return True
        return False

    def _is_recent(self, at_ns: int, now_ns: int) -> bool:
        # A time ahead is of before the clock was set back.
        return 0 <= now_ns - at_ns < self.config.settle_s * 1e9

    # -- bookkeeping -------------------------------------------------------------------------

    def _attach(self, instance_id: int, number: int) -> None:
        self._cluster_of[instance_id], self._instance_of[number] = number, instance_id

    def _detach(self, number: int) -> int:
        instance_id = self._instance_of.pop(number)
        del self._cluster_of[instance_id]
        return instance_id

    def _near(self, position: Point) -> list[Instance]:
        x, y = _cell(position)
        around = ((x + i, y + j) for i in (-1, 0, 1) for j in (-1, 0, 1))
        return [self._instances[k] for cell in around for k in sorted(self._cells.get(cell, ()))]

    def _new(self, sighting: Sighting, source: Source, now_ns: int) -> Instance:
        self._make_room()
        seen = {f.name: getattr(sighting, f.name) for f in dataclasses.fields(Sighting)}
        instance = Instance(
            **seen,
            instance_id=self._next,
            source=source,
            first_seen_ns=now_ns,
            last_seen_ns=now_ns,
        )
        self._next += 1
        return self._put(instance)

    def _make_room(self) -> None:
        if len(self._instances) < self.config.max_instances:
            return
        oldest = min(
            self._instances.values(),
            key=lambda one: (_noted(one), not one.is_gone, one.gone_ns, one.last_seen_ns),
        )
        self.remove(oldest.instance_id)

    def _put(self, instance: Instance) -> Instance:
        key = instance.instance_id
        before = self._instances.get(key)
        if before is not None:
            self._cells[_cell(before.position_world)].discard(key)
        self._cells.setdefault(_cell(instance.position_world), set()).add(key)
        self._instances[key] = instance
        self._changes.changed[key] = instance
        self._shown = None
        return instance


def _seen_now(known: Instance, sighting: Sighting, now_ns: int) -> Instance:
    seen = {f.name: getattr(sighting, f.name) for f in dataclasses.fields(Sighting)}
    seen["attributes"] = sighting.attributes or known.attributes
    if sighting.label != known.label:
        # The picture was chosen for what it was taken for before.
        seen["view_score"] = 0.0
    return dataclasses.replace(known, **seen, last_seen_ns=now_ns, gone_ns=0)


def _noted(one: Instance) -> bool:
    """Return whether a person has said something of a thing."""
    return bool(one.name or one.denied)


def _cell(position: Point) -> tuple[int, int]:
    return math.floor(position[0] / _CELL_M), math.floor(position[1] / _CELL_M)
