"""What a search takes from memory, and what memory learns from it."""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from ippon.guidance.language.naming import is_instance_of
from ippon.mapping.objects.recalled_evidence import (
    RecalledEvidence,
    posterior_of,
    recall_evidence,
    withdraw_evidence,
)
from ippon.mapping.voxel_map import VoxelMap
from ippon.memory.instance import Instance, Sighting
from ippon.memory.instance_memory import InstanceMemory
from ippon.memory.map_clusters import MapClusters, share_known, share_observed
from ippon.mission.finds.attributes.attribute_check import seen_attributes
from ippon.mission.finds.image_check import ImageCheck
from ippon.mission.finds.rejection import exclude_only, is_clear_of
from ippon.mission.search import Search
from ippon.mission.snapshot import Find

_SECOND_NS: Final = 1_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class RecollectionConfig:
    """How far memory is trusted."""

    recalled_probability: float = 0.9
    """Of the surface where a thing was last seen, when it is searched for again; above
    `PlannerConfig.ooi_threshold` the robot goes there first. More needs more images to unlearn."""
    disproved_probability: float = 0.3
    """Below this a voxel of a thing is not there any more; more gives it up sooner."""
    hidden_share: float = 0.2
    """Share of its voxels that may be left, because no image shows them, when a thing is not there
    any more; more gives it up sooner."""
    update_every_s: float = 1.0
    """Interval at which the map's things are taken into memory."""

    def __post_init__(self) -> None:
        """Reject probabilities and intervals without meaning."""
        low, high = self.disproved_probability, self.recalled_probability
        if not 0.0 < low < high < 1.0 or not self.update_every_s >= 0.0:
            raise ValueError(
                "disproved_probability lies above 0 and below recalled_probability, that below 1, "
                f"and update_every_s is not negative; got {low}, {high}, {self.update_every_s}"
            )
        if not 0.0 <= self.hidden_share < 1.0:
            raise ValueError(f"hidden_share lies in 0 to below 1; got {self.hidden_share}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Recalled:
    """A thing that the present search takes from memory."""

    instance_id: int
    evidence: RecalledEvidence
    is_part: bool = False
    """Whether the map had given the place up and has seen too little of it since."""


@dataclass(slots=True, kw_only=True, eq=False)
class _Followed:
    """A present search, and what memory has noted of it."""

    search: Search
    found: dict[int, int] = field(default_factory=dict[int, int])
    """Things that it has found, by the number of the find."""

    def besides(self, number: int | None) -> set[int]:
        """Return the things that it has found, without that of a find."""
        return {thing for find, thing in self.found.items() if find != number}


class Recollection:
    """Joins one map's memory to its searches, in the thread of the mission.

    Args:
        voxel_map: The map, in whose frame the things lie.
        memory: What is remembered.
        config: How far it is trusted.
    """

    def __init__(
        self,
        voxel_map: VoxelMap,
        memory: InstanceMemory,
        config: RecollectionConfig | None = None,
    ) -> None:
        self.memory = memory
        self._map = voxel_map
        self._config = config or RecollectionConfig()
        self._clusters = MapClusters(voxel_map)
        self._recalled: list[_Recalled] = []
        self._followed: tuple[_Followed, ...] = ()
        """The present search, or those of a tour."""
        self._known_before: frozenset[int] = frozenset()
        """Things that were remembered when they began."""
        self._updated_ns: int | None = None
        self._check: ImageCheck | None = None
        self._images = 0
        """Images that the search of the last update had compared with its candidates by then."""

    def begin(self, search: Search) -> tuple[Instance, ...]:
        """Give a search that begins the places where its object was seen before.

        The map itself knows where common objects are.

        Returns:
            The things whose places are looked at first.

        Raises:
            ValueError: The search belongs to a tour, whose evidence the map keeps elsewhere.
        """
        if search.layer is not None:
            raise ValueError(
                f"memory begins searches for one goal; {search.goal.display} belongs to a tour"
            )
        self.follow((search,))
        named = self._named(search)
        if search.goal.object in self._map.labels:
            return () if named is None else (named,)
        for one in self.memory.instances() if named is None else (named,):
            known = one.source == "search" and not one.is_gone and _answers(one, search)
            if known and not search.is_rejected(_find_at(one)):
                self._recalled.append(self._recall(one))
        recalled = (self.memory.get(one.instance_id) for one in self._recalled)
        return tuple(one for one in recalled if one is not None)

    def follow(self, searches: Iterable[Search]) -> None:
        """Note from now on what searches find, such as those of a tour; nothing is recalled."""
        self._followed, self._recalled = tuple(_Followed(search=one) for one in searches), []
        self._known_before = frozenset(one.instance_id for one in self.memory.instances())
        for one in self._followed:
            self.exclude(one.search)

    def _recall(self, one: Instance) -> _Recalled:
        """Add to the map what memory knows of a place."""
        p = self._config.recalled_probability
        size = np.array(one.size_m) + self._map.config.voxel_size_m
        evidence = recall_evidence(
            self._map, np.array(one.position_world), size, math.log(p / (1.0 - p))
        )
        return _Recalled(instance_id=one.instance_id, evidence=evidence)

    def exclude(self, search: Search) -> None:
        """Keep a search from what a person has said that it is not.

        A search for a named thing is kept from the others of its kind, too, as far as these do not
        touch it.
        """
        named = self._named(search)
        kept = None if named is None or named.is_gone else _find_at(named)
        for one in self.memory.instances():
            if one.is_gone or one is named:
                continue
            find = _find_at(one)
            denied = any(is_instance_of(label, search.goal.object) for label in one.denied)
            other = (
                kept is not None and _answers(one, search) and is_clear_of(self._map, find, kept)
            )
            if (denied or other) and not search.is_rejected(find):
                exclude_only(search, self._map, find)

    def _named(self, search: Search) -> Instance | None:
        """Return the thing that a search is for; None for any of its kind."""
        number = search.goal.thing_id
        return None if number is None else self.memory.get(number)

    def step(self, search: Search | None, now_ns: int) -> tuple[Instance, ...]:
        """Learn from map and search, after each frame.

        Args:
            search: The present one.
            now_ns: Nanoseconds since 1970.

        Returns:
            The things that answer the search and are not there any more, as was noticed now.
        """
        gone: list[Instance] = []
        if search is not None and self._of(search) is not None:
            # What is found moves the thing to where it was found, before that place is judged.
            for one in self._followed:
                self._note_finds(one, now_ns)
            gone += self._disprove(search, now_ns)
        since = None if self._updated_ns is None else now_ns - self._updated_ns
        if since is None or not 0 <= since < self._config.update_every_s * _SECOND_NS:
            self._updated_ns = now_ns
            gone += self._update(search, now_ns)
        return tuple(gone)

    def update(self, now_ns: int) -> None:
        """Take the map's things into memory now."""
        self._update(None, now_ns)

    def _update(self, search: Search | None, now_ns: int) -> list[Instance]:
        changes = self._clusters.update()
        gone = self.memory.update(changes, now_ns, lambda one: share_observed(self._map, one))
        if search is None:
            return []
        if search.goal.object not in self._map.labels:
            check = search.image_check
            before = self._images if check is self._check else check.images
            self._check, self._images = check, check.images
            for find in search.candidates:
                # The map shows it also where no image does any more.
                is_seen = check.last_image_of(find) > before
                if is_seen and check.confirms(find) and not search.is_rejected(find):
                    number, followed = search.find and search.find.number, self._of(search)
                    others = () if followed is None else followed.besides(number)
                    self.memory.note_find(_sighting(search, find), now_ns, others)
        return [one for one in gone if _answers(one, search)]

    def _disprove(self, search: Search, now_ns: int) -> list[Instance]:
        """Return what was recalled, and what images and depth have worn off since.

        Evidence that the search itself has removed says nothing of whether the thing is there.
        """
        gone: list[Instance] = []
        left: list[_Recalled] = []
        arrays = self._map.arrays()
        for recalled in self._recalled:
            known = self.memory.get(recalled.instance_id)
            if known is None or known.is_gone or search.is_rejected(_find_at(known)):
                withdraw_evidence(self._map, recalled.evidence)
                continue
            if search.is_set_aside(_find_at(known)):
                left.append(recalled)
                continue
            recalled = self._observed_again(recalled, known)  # noqa: PLW2901 - in its place
            if recalled.is_part:
                left.append(recalled)
                continue
            believed = posterior_of(arrays, recalled.evidence.voxels)
            there = np.count_nonzero(believed >= self._config.disproved_probability)
            seen_again = any(
                _is_at(find, known) and search.image_check.confirms(find)
                for find in search.candidates
            )
            if there > self._config.hidden_share * len(believed) or seen_again:
                left.append(recalled)
                continue
            withdraw_evidence(self._map, recalled.evidence)
            instance = self.memory.mark_gone(recalled.instance_id, now_ns)
            gone += [] if instance is None else [instance]
        self._recalled = left
        return gone

    def _observed_again(self, recalled: _Recalled, known: Instance) -> _Recalled:
        """Recall a place anew that the map had given up: when it is seen again, and as a whole."""
        enough, voxels = self.memory.config.gone_share, recalled.evidence.voxels
        is_lost = not len(voxels) or share_known(self._map, voxels) < enough
        if not is_lost and not recalled.is_part:
            return recalled
        is_part = share_observed(self._map, known) < enough
        if not is_lost and is_part:
            return recalled
        withdraw_evidence(self._map, recalled.evidence)
        return replace(self._recall(known), is_part=is_part)

    def _note_finds(self, followed: _Followed, now_ns: int) -> None:
        """Remember what a search has found; forget what is rejected."""
        search, found = followed.search, followed.found
        if search.goal.object in self._map.labels:
            return
        finds = {find.number: find for find in search.finds}
        for number in found.keys() - finds.keys():
            self._forget(found.pop(number), search)
        for number in sorted(finds.keys() - found.keys()):
            sighting = _sighting(search, finds[number])
            noted = self.memory.note_find(sighting, now_ns, followed.besides(number))
            found[number] = noted.instance_id

    def _forget(self, instance_id: int, search: Search) -> None:
        """Forget what was rejected, unless people have said something of it.

        Where the search is for a certain one, what it did not find itself stays: it may be another.
        """
        known, goal = self.memory.get(instance_id), search.goal
        if known is None or known.name or known.denied:
            return
        is_for_any = not (goal.attributes or goal.context or goal.other) and goal.thing_id is None
        if is_for_any or instance_id not in self._known_before:
            self.memory.remove(instance_id)

    def _of(self, search: Search) -> _Followed | None:
        return next((one for one in self._followed if one.search is search), None)


def _answers(one: Instance, search: Search) -> bool:
    return bool(one.believed) and is_instance_of(one.believed, search.goal.object)


def _find_at(one: Instance) -> Find:
    """Return a thing as a find in the map."""
    return Find(
        position_world=one.position_world,
        size_m=one.size_m,
        probability=one.probability,
        voxels=one.voxels,
        box_px=None,
    )


def _is_at(find: Find, known: Instance) -> bool:
    """Return whether a candidate lies where a thing was."""
    reach = 0.5 * (max(find.size_m) + max(known.size_m))
    return math.dist(find.position_world, known.position_world) <= reach


def _sighting(search: Search, find: Find) -> Sighting:
    return Sighting(
        label=search.goal.object,
        probability=find.probability,
        position_world=find.position_world,
        size_m=find.size_m,
        voxels=find.voxels,
        attributes=seen_attributes(find.attributes or search.judged(find)),
    )
