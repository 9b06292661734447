import pytest

from app.errors import MemoryFileError
from app.memory.room_names import (
    checked_name,
    read_room_names,
    room_names_path,
    write_room_names,
)
from ippon.rooms.named_rooms import RoomName

NAMES = (RoomName(x_m=1.0, y_m=2.0, name="Anna's room"),)


def test_names_are_kept_beside_the_map(tmp_path):
    path = room_names_path(tmp_path / "home.map")
    assert path.name == "home.map.rooms.json"
    assert read_room_names(path) == ()
    write_room_names(path, NAMES)
    assert read_room_names(path) == NAMES


@pytest.mark.parametrize("content", [b"", b"{}", b'[{"name": 3}]', b"\xff", b'[{"name": "\xff"}]'])
def test_a_damaged_file_is_refused(tmp_path, content):
    path = tmp_path / "home.map.rooms.json"
    path.write_bytes(content)
    with pytest.raises(MemoryFileError, match=r"home.map.rooms.json holds no names of rooms"):
        read_room_names(path)


def test_a_folder_that_is_not_there_is_told(tmp_path):
    with pytest.raises(MemoryFileError, match=r"are not kept in home\.map\.rooms\.json"):
        write_room_names(tmp_path / "none" / "home.map.rooms.json", NAMES)


def test_names_are_short_and_printable():
    assert checked_name("  Anna's   room ") == "Anna's room"
    assert checked_name(" ") == ""
    for name in ("x" * 41, "a\x07b"):
        with pytest.raises(ValueError, match="at most 40 printable characters"):
            checked_name(name)
