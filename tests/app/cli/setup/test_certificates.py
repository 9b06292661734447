from app.cli import main


def test_files_that_were_there_and_lack_what_is_asked_for_are_named(tmp_path, capsys):
    folder = str(tmp_path / "tls")
    assert main.run(["certificates", folder]) == 0
    assert main.run(["certificates", folder]) == 0
    assert capsys.readouterr().err == ""
    again = ["certificates", folder, "--hosts", "robot.local", "127.0.0.1", "--robot", "scout"]
    assert main.run(again) == 0
    said = capsys.readouterr().err
    assert "the navigator's files were there and do not name robot.local, scout: delete" in said
    for name in ("navigator.pem", "navigator.json5"):
        (tmp_path / "tls" / name).unlink()
    assert main.run(again) == 0
    assert capsys.readouterr().err == ""
    # Without the options nobody has asked for anything.
    assert main.run(["certificates", folder]) == 0
    assert capsys.readouterr().err == ""
