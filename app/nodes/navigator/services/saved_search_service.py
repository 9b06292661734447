"""Requests about saved searches, which a file keeps across restarts."""

import threading
from pathlib import Path
from typing import Final

import msgspec

from app.links.network.latched_topic import Topic
from app.links.network.requests import RequestRefusedError
from app.messages.control import (
    Accepted,
    SavedSearch,
    SavedSearches,
    SavedSearchRequest,
    SearchRequest,
    decode,
    encode,
)
from app.nodes.navigator.services.goal_service import GoalService
from app.nodes.navigator.services.queue_service import told
from ippon.atomic_file import replace_file, set_aside

MAX_SAVED: Final = 50


class SavedSearchService:
    """Keeps, runs and deletes saved searches; requests come in the thread of their key."""

    def __init__(self, goals: GoalService, topic: Topic, path: Path | None) -> None:
        """Read and publish the searches of earlier runs.

        Args:
            goals: Starts searches.
            topic: Topic of the saved searches.
            path: File that keeps them; None keeps them only while the process runs.
        """
        self._goals = goals
        self._topic = topic
        self._path = path
        self._lock = threading.Lock()
        self._saved = SavedSearches(searches=[]) if path is None else self._read(path)
        self._topic.put(encode(self._saved))

    def change(self, request: SavedSearchRequest) -> Accepted:
        """Save a search, run a saved one, or delete it."""
        if request.action == "save":
            return self._save(request)
        with self._lock:
            known = (one for one in self._saved.searches if one.saved_id == request.saved_id)
            saved = next(known, None)
            if saved is None:
                raise RequestRefusedError(f"there is no saved search {request.saved_id} any more")
            if request.action == "delete":
                self._keep([one for one in self._saved.searches if one is not saved])
                return Accepted(detail=f"{saved.object} is no longer saved")
        wanted = SearchRequest(
            object=saved.object,
            context=saved.context,
            scenario=saved.scenario,
            attributes=saved.attributes,
            count=saved.count,
            other=saved.other,
        )
        return Accepted(detail=told(self._goals.search(wanted, f"saved search {saved.saved_id}")))

    def _save(self, request: SavedSearchRequest) -> Accepted:
        wanted = request.object.strip()
        search = None if request.goal_id is None else self._goals.known(request.goal_id)
        if request.goal_id is not None and search is None:
            raise RequestRefusedError(f"there is no goal {request.goal_id} any more")
        # A search that could not start is not saved either.
        self._goals.plan(
            SearchRequest(object=wanted or " ", context=request.context, scenario=request.scenario)
        )
        with self._lock:
            known = self._saved.searches
            new = SavedSearch(
                saved_id=self._saved.next_id,
                object=wanted,
                context=request.context,
                scenario=request.scenario,
                attributes=list(search.goal.attributes) if search else [],
                count=search.goal.count if search else 1,
                other=bool(search and search.goal.other),
            )
            if any(msgspec.structs.replace(one, saved_id=new.saved_id) == new for one in known):
                return Accepted(detail=f"{wanted} is saved already")
            if len(known) >= MAX_SAVED:
                raise RequestRefusedError(f"{MAX_SAVED} searches are saved; delete one first")
            self._keep([*known, new], next_id=new.saved_id + 1)
        return Accepted(detail=f"{wanted} is saved")

    def _keep(self, searches: list[SavedSearch], next_id: int | None = None) -> None:
        """Write and publish; with the lock held."""
        saved = SavedSearches(
            searches=searches, next_id=next_id or self._saved.next_id, note=self._saved.note
        )
        if self._path is not None:
            try:
                self._path.parent.mkdir(parents=True, exist_ok=True)
                replace_file(self._path, encode(msgspec.structs.replace(saved, note="")))
            except OSError as error:
                why = error.strerror or error
                raise RequestRefusedError(
                    f"the searches are not kept in {self._path.name}: {why}"
                ) from error
        self._saved = saved
        self._topic.put(encode(saved))

    def _read(self, path: Path) -> SavedSearches:
        """Read the file; one that cannot be used is set aside."""
        try:
            if not path.exists():
                return SavedSearches(searches=[])
            return decode(path.read_bytes(), SavedSearches)
        except (msgspec.MsgspecError, OSError) as error:
            problem = f"no searches were read from {path.name} ({error})"
        try:
            kept = f"the file is kept as {set_aside(path).name}"
        except OSError as error:
            self._path = None
            kept = f"it is left where it is ({error.strerror}), and none are kept in this run"
        return SavedSearches(searches=[], note=f"{problem}; {kept}")
