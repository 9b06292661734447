"""Every `ippon` line of the guides is run, in the order in which a reader would."""

import json
import shutil

import pytest

from tests.document_shell import DocumentShell, lines_of
from tests.locations import ROOT, SHARED

pytestmark = [pytest.mark.large, pytest.mark.process, pytest.mark.timeout(1500)]

GUIDES = [
    *sorted((ROOT / "docs" / "guides").glob("*.md")),
    *sorted((ROOT / "docs" / "users").glob("*.md")),
]
ROBOT, ROS2, NETWORK = "guides/robot.md", "guides/ros2.md", "guides/network.md"
SECURITY, RECORDINGS, VIEWERS = "guides/security.md", "guides/recordings.md", "guides/viewers.md"
RESEARCHER, OPERATOR = "guides/researcher.md", "guides/operator.md"
REQUESTER, REVIEWER = "users/requester.md", "users/reviewer.md"
KITCHEN = SHARED / "rgbd" / "redkitchen_a"
NETWORKS = SHARED / "models" / "nanodet_plus_m_416"
NANODET = "nanodet/nanodet-plus-m_416.param"
NO_WEIGHTS = "needs weights from the internet; tests/ippon/segmentation runs tiny ones"
OPEN_VOCABULARY = "ippon recognise FOLDER --find cup,tv --segmentation.backend "
NOT_RUN = {
    (NETWORK, OPEN_VOCABULARY + options): NO_WEIGHTS
    for options in (
        "sam3",
        "sam3-lite",
        "grounding-dino",
        "grounding-dino --segmentation.masks-model yonigozlan/EdgeTAM-hf",
        "grounding-dino --segmentation.masks-model none",
        "owlv2",
    )
} | {(VIEWERS, "ippon rerun"): "needs a screen; --save and --url are run"}
"""Lines that are not run, and why."""


@pytest.fixture(scope="module")
def shell(tmp_path_factory):
    """A reader's folder, with a profile, and the network and the recording that they have."""
    if shutil.which("unshare") is None or shutil.which("nsenter") is None:
        pytest.skip("util-linux, which makes networks of their own, is not installed")
    shell = DocumentShell(tmp_path_factory.mktemp("reader"))
    if not shell.is_up:
        shell.close()
        pytest.skip("this user may not make networks")
    shell.run(ROBOT, "ippon profile > scout.yaml")
    yield shell
    shell.close()


@pytest.fixture(autouse=True)
def _free_ports(shell):
    yield
    shell.kill_all()


def test_profiles_bridge_certificates_and_users(shell):
    drawn = shell.run(ROBOT, "ippon profile scout.yaml --picture scout.png")
    assert "speed" in drawn
    assert (shell.folder / "scout.png").read_bytes().startswith(b"\x89PNG")
    shell.run(ROS2, "ippon profile > scout.yaml")
    shell.run(ROS2, "ippon profile scout.yaml --picture scout.png")
    shell.run(ROS2, "ippon ros2 --write bridge")
    assert (shell.folder / "bridge" / "pyproject.toml").exists()
    shell.run(
        SECURITY,
        "ippon certificates tls --robot robot-1 robot-2 --hosts robot-1.local robot-2.local",
        tls="several",
    )
    assert (shell.folder / "several" / "ca.pem").exists()
    secret = "a longer secret\n"
    shell.run(SECURITY, "ippon user anna --role operator --users users", says=2 * secret)
    assert (shell.folder / "users").read_text().startswith("anna:operator:")
    assert "chair" in shell.run(REQUESTER, 'ippon read "two chairs, not in the kitchen"')


def test_a_search_that_requesters_and_viewers_see(shell):
    demo = shell.start(
        ROBOT,
        "scripts/demo --profile scout.yaml --object bed",
        **{"scripts/demo": "ippon demo --speed max --home 3 --no-search"},
    )
    demo.wait_for("http://127.0.0.1:8080")
    demo.wait_for("simulated robot in home-")
    given = shell.run(REQUESTER, 'ippon ask --nearest "my keys in the kitchen"')
    assert "keys" in given
    asked = shell.start(REQUESTER, 'ippon ask "my keys and the red mug" --follow')
    asked.wait_for("searching for keys")
    saved = shell.start(VIEWERS, "ippon rerun --save search.rrd").wait_for("receiving robot")
    served = shell.start(VIEWERS, "ippon foxglove").wait_for("ws://127.0.0.1:8765")
    sent = shell.also("python -m rerun --serve-grpc --port 9876").wait_for("9876")
    streamed = shell.start(
        VIEWERS,
        "ippon rerun --url rerun+http://192.168.1.20:9876/proxy",
        **{"192.168.1.20": "127.0.0.1"},
    ).wait_for("receiving robot")
    for viewer in (saved, served, streamed):
        viewer.interrupt()
    sent.kill()
    assert (shell.folder / "search.rrd").stat().st_size > 10_000
    shell.run(VIEWERS, "ippon foxglove --layout ippon-layout.json")
    assert json.loads((shell.folder / "ippon-layout.json").read_text())
    shown = shell.run(REQUESTER, "ippon control")
    assert "goal 1, keys" in shown
    assert "red mug" in shown
    shell.run(REQUESTER, "ippon control cancel")
    shell.start(REQUESTER, "ippon memory --find mug")
    assert "stopped" in shell.run(REQUESTER, "ippon control stop")
    shell.run(REQUESTER, "ippon control resume")
    asked.kill()
    demo.interrupt()


def test_the_recording_of_a_search(shell):
    shell.also("ippon demo --headless --exit-when-done --speed max --home 3 --object bed").finish(
        timeout_s=300.0
    )
    sessions = sorted((shell.folder / "home").rglob("session_0.mcap"))
    file = str(sessions[-1])
    listed = shell.start(RECORDINGS, "ippon review").wait_for(r"http://127.0.0.1:\d+")
    listed.interrupt()
    shell.start(RECORDINGS, "ippon review FILE", FILE=file).wait_for(r"http://127").interrupt()
    both = shell.start(RECORDINGS, "ippon review A B", A=file, B=file)
    both.wait_for(r"http://127").interrupt()
    again = shell.start(
        RECORDINGS,
        "ippon review FILE --recompute --set map.voxel_size_m=0.05 guidance.levels.sofa=far",
        FILE=file,
    )
    again.wait_for(r"http://127", timeout_s=600.0).interrupt()
    assert ".html" in shell.run(REVIEWER, "ippon export FILE report", FILE=file)


def test_processes_with_certificates(shell):
    shell.run(
        SECURITY,
        "ippon certificates tls --hosts robot.local 192.168.1.20 127.0.0.1",
        **{"robot.local": "localhost"},
    )
    navigator = shell.start(
        SECURITY,
        "IPPON_ZENOH_PROFILE=tls/navigator.json5 ippon navigate --listen tls/0.0.0.0:7447",
    )
    robot = shell.also(
        "IPPON_ZENOH_PROFILE=tls/robot.json5 ippon sim --home 3 --connect tls/127.0.0.1:7447"
    ).wait_for("simulated robot in home-")
    near = {"robot.local": "127.0.0.1"}
    console = shell.start(
        SECURITY,
        "IPPON_ZENOH_PROFILE=tls/console.json5 ippon console --connect tls/robot.local:7447",
        **near,
    ).wait_for("console at http://127.0.0.1:8080")
    asked = shell.run(
        SECURITY,
        "IPPON_ZENOH_PROFILE=tls/requester.json5 ippon ask hat --connect tls/robot.local:7447",
        **near,
    )
    assert "hat" in asked
    profile, navigator_at = (
        "IPPON_ZENOH_PROFILE=tls/requester.json5",
        "--connect tls/127.0.0.1:7447",
    )
    assert "hat" in shell.also(f"{profile} ippon control {navigator_at}").finish()
    shell.also(f"{profile} ippon memory --json {navigator_at} || [ $? = 1 ]").finish()
    console.interrupt()
    key = shell.folder / "tls" / "console.key"
    shutil.copy(key, shell.folder / "key.pem")
    shutil.copy(key.with_suffix(".pem"), shell.folder / "cert.pem")
    locked = shell.start(
        SECURITY,
        "ippon console --host 0.0.0.0 --users users --tls-cert cert.pem --tls-key key.pem "
        "--names robot.example.org",
    ).wait_for("https://")
    for one in (locked, robot, navigator):
        one.interrupt()


def test_a_profile_a_map_and_a_second_robot(shell):
    navigator = shell.start(
        ROBOT,
        "ippon navigate --profile scout.yaml --listen tcp/0.0.0.0:7447 --segmentation.where here "
        "--map home.map",
        **{"--segmentation.where here": ""},
    )
    console = shell.start(ROBOT, "ippon console").wait_for("console at http://127.0.0.1:8080")
    robot = shell.also("ippon sim --home 3 --profile scout.yaml").wait_for("simulated robot in")
    for guide in (ROBOT, ROS2):
        checked = shell.run(guide, "ippon doctor --robot ippon --profile scout.yaml")
        assert "from image to command" in checked
    join = """echo '{connect: {endpoints: ["tcp/127.0.0.1:7447"]}}' > join.json5"""
    shell.also(join).finish()
    second = shell.start(
        OPERATOR,
        "IPPON_ZENOH_PROFILE=join.json5 ippon navigate --robot robot-2 --listen tcp/0.0.0.0:7447",
        **{"0.0.0.0:7447": "0.0.0.0:7449"},
    ).wait_for("navigator ready")
    other = shell.also("ippon sim --home 7 --robot robot-2 --connect tcp/127.0.0.1:7449")
    other.wait_for("simulated robot in home-")
    named = shell.also("ippon ask hat --robot robot-2")
    assert "hat" in named.finish()
    for one in (other, second, robot, console, navigator):
        one.interrupt()
    assert (shell.folder / "home.map").exists()


def test_a_robot_with_a_router_of_its_own_and_a_language_model(shell):
    navigator = shell.start(
        ROS2,
        "ippon navigate --profile scout.yaml --listen tcp/0.0.0.0:7448 --segmentation.where here",
        **{"--segmentation.where here": ""},
    ).wait_for("navigator ready")
    robot = shell.also("ippon sim --home 3 --profile scout.yaml --connect tcp/127.0.0.1:7448")
    robot.wait_for("simulated robot in home-")
    console = shell.start(ROS2, "ippon console --connect tcp/127.0.0.1:7448")
    console.wait_for("console at http://127.0.0.1:8080")
    shell.run(ROS2, "ippon doctor --robot ippon --connect tcp/127.0.0.1:7448 --profile scout.yaml")
    for one in (console, robot, navigator):
        one.interrupt()
    with_model = shell.start(
        NETWORK,
        "ippon navigate --llm.model MODEL --llm.base-url http://127.0.0.1:11434/v1 "
        "--llm.second-opinion",
        MODEL="llama3.1",
    )
    with_model.wait_for("navigator ready").interrupt()


@pytest.mark.skipif(not NETWORKS.is_dir() or not KITCHEN.is_dir(), reason="no recording at hand")
def test_a_network_on_a_recording_and_live(shell):
    if not (shell.folder / "nanodet").exists():  # It is there in a second attempt.
        (shell.folder / "nanodet").symlink_to(NETWORKS, target_is_directory=True)
    folder, parts = str(KITCHEN), "--segmentation.backend detector --segmentation.model"
    found = shell.start(
        NETWORK,
        f"ippon recognise FOLDER --find cup,tv,chair {parts} {NANODET} --page page.html",
        FOLDER=folder,
    ).finish(timeout_s=400.0)
    assert "cup" in found
    assert "<html" in (shell.folder / "page.html").read_text("utf-8")
    shell.start(
        NETWORK,
        f"ippon calibrate FOLDER... --out table.json {parts} FILE",
        **{"FOLDER...": folder, "FILE": NANODET},
    ).finish(timeout_s=400.0)
    shell.start(
        NETWORK,
        f"ippon recognise FOLDER --find cup,tv --observation-model table.json {parts} FILE",
        FOLDER=folder,
        FILE=NANODET,
    ).finish(timeout_s=400.0)
    here = f"--segmentation.where here {parts} {NANODET}"
    for guide, line in (
        (NETWORK, f"ippon navigate {here}"),
        (ROS2, f"ippon navigate --profile scout.yaml --listen tcp/0.0.0.0:7447 {here}"),
    ):
        shell.start(guide, line).wait_for("navigator ready").interrupt()
    navigator = shell.start(
        NETWORK,
        f"ippon navigate --voxel-size-m 0.05 --segmentation.where here {parts} {NANODET}",
    ).wait_for("navigator ready")
    console = shell.start(NETWORK, "ippon console").wait_for("console at http")
    replayed = shell.start(NETWORK, "ippon replay FOLDER --rate 0.5", FOLDER=folder)
    asked = shell.also("ippon ask cup --follow").wait_for("where cup can be seen", 240.0)
    asked.kill()
    for one in (replayed, console, navigator):
        one.interrupt()


def test_an_evaluation(shell):
    shell.start(
        RESEARCHER,
        "ippon eval run --out results --homes 1001:1010 --methods ippon,no_guidance,"
        "nearest_frontier --workers 2",
        **{"1001:1010": "1001 --limit 1 --max-time-s 40"},
    ).finish(timeout_s=600.0)
    reported = shell.run(RESEARCHER, "ippon eval report results")
    assert "nearest_frontier" in reported
    shutil.copytree(shell.folder / "results", shell.folder / "before")
    reported = shell.run(RESEARCHER, "ippon eval report results --against before")
    assert "ippon (before)" in reported
    reported = shell.run(RESEARCHER, "ippon eval report results --detail")
    assert "where SPL is lost" in reported
    rows = [json.loads(one.read_text()) for one in (shell.folder / "results/rows").glob("*.json")]
    episode = rows[0]["episode_id"]
    shell.start(
        RESEARCHER,
        "ippon eval replay results EPISODE --method METHOD",
        EPISODE=str(episode),
        METHOD="ippon",
    ).finish(timeout_s=300.0)
    first = shell.start(
        ROBOT,
        "ippon eval run --robot scout.yaml --homes 1001:1010 --out scout && "
        "ippon eval report scout",
        **{"1001:1010": "1001 --limit 1 --max-time-s 40"},
    )
    assert "SPL" in first.finish(timeout_s=600.0)


def test_no_line_is_left_out(shell, request):
    chosen = {one.name for one in request.session.items if one.path == request.path}
    if len(chosen) < len([name for name in globals() if name.startswith("test_")]):
        pytest.skip("only some of the lines were asked for")
    if not KITCHEN.is_dir():
        pytest.skip("the lines about recordings were not run")
    # A line that stands in two guides is run once.
    known = {line for _, line in shell.ran | set(NOT_RUN)}
    documents = {str(one.relative_to(ROOT / "docs")): lines_of(one) for one in GUIDES}
    left = [
        (name, line) for name, lines in documents.items() for line in lines if line not in known
    ]
    assert left == []
    gone = [one for one in NOT_RUN if one[1] not in documents[one[0]]]
    assert gone == []
