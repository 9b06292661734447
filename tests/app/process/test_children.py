import socket

import pytest

from app.process.children import Child, free_port, port_is_free, wait_for_end


@pytest.mark.process
def test_a_folder_of_the_user_named_app_is_not_taken_for_the_program(tmp_path, monkeypatch, capfd):
    (tmp_path / "app").mkdir()
    (tmp_path / "app" / "__init__.py").write_text("")
    (tmp_path / "app" / "__main__.py").write_text("print('another program')")
    monkeypatch.chdir(tmp_path)
    child = Child("console", ["console", "--port", "99999"])
    assert wait_for_end([child], 60.0) is child
    assert child.ended() == 2
    assert "a port lies in 0 to 65535" in capfd.readouterr().err


def test_the_first_free_port_passes_over_a_taken_one():
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        assert not port_is_free(port)
        assert free_port(port) > port
        with pytest.raises(OSError, match="no free port among"):
            free_port(port, tries=1)
