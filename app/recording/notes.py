"""Notes and marks of users, stored beside a recording, which stays unchanged."""

from pathlib import Path
from typing import Annotated, Final, Literal

import msgspec
from msgspec import Meta

from app.messages.control import decode
from app.recording.errors import RecordingError
from ippon.atomic_file import replace_file

MAX_NOTES: Final = 10_000
NoteText = Annotated[str, Meta(max_length=2000)]


class Note(msgspec.Struct, frozen=True, kw_only=True):
    """A user's note on one moment of a recording."""

    time_ns: int
    """Time in the recording, nanoseconds since 1970."""
    kind: Literal["note", "mark"]
    text: NoteText
    author: Annotated[str, Meta(max_length=80)] = ""


def notes_path(recording: Path) -> Path:
    """Return the path of a recording's notes."""
    return recording.with_suffix(".notes.json")


def read_notes(recording: Path) -> list[Note]:
    """Return the notes of a recording, ordered by time.

    Raises:
        RecordingError: The file cannot be decoded.
    """
    path = notes_path(recording)
    try:
        notes = decode(path.read_bytes(), list[Note])
    except FileNotFoundError:
        return []
    except (OSError, msgspec.DecodeError) as error:
        raise RecordingError(f"the notes in {path} cannot be read: {error}") from error
    return sorted(notes, key=lambda note: note.time_ns)


def readable_notes(recording: Path) -> tuple[list[Note], tuple[str, ...]]:
    """Return the notes of a recording, and why they cannot be read, if so."""
    try:
        return read_notes(recording), ()
    except RecordingError as error:
        return [], (str(error),)


def add_note(recording: Path, note: Note) -> list[Note]:
    """Add a note atomically; return all notes.

    Raises:
        RecordingError: The present notes cannot be read, or the new ones cannot be written.
    """
    notes = sorted([*read_notes(recording), note], key=lambda n: n.time_ns)
    if len(notes) > MAX_NOTES:
        raise RecordingError(f"a recording has at most {MAX_NOTES} notes")
    path = notes_path(recording)
    try:
        replace_file(path, msgspec.json.format(msgspec.json.encode(notes)))
    except OSError as error:
        raise RecordingError(f"the note cannot be written to {path}: {error.strerror}") from error
    return notes
