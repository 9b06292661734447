"""Commands of the panels as requests to a stand-in for the navigator."""

from app.messages.control import Accepted, FeedbackRequest, SearchAccepted
from app.messages.recording import RecordingStatus, RecordRequest
from app.nodes import recorder
from app.nodes.console.link.panel_requests import PanelRequests
from app.view.words import ENGLISH


class Requests(PanelRequests):
    """Accept every search, and note what it joins."""

    say = ENGLISH

    def __init__(self):
        self.joins, self.feedback, self.timeout_s = [], [], None

    def _request(self, topic, message, kind, timeout_s=None):
        self.timeout_s = timeout_s
        if isinstance(message, RecordRequest):
            return RecordingStatus(state="recording", text="recording")
        if isinstance(message, FeedbackRequest):
            self.feedback.append((message.verdict, message.goal_id, message.find))
            return Accepted()
        self.joins.append(message.joins)
        return SearchAccepted(
            goal_id=len(self.joins) + 6,
            object=message.object,
            position=1 if len(self.joins) == 1 else 0,
            joined=message.joins,
        )


def test_a_search_joins_the_goal_that_it_is_told_to():
    requests = Requests()
    first = requests.search("keys", "", "a flat")
    assert first == ("Looking for: keys, after 1 other goal.", 7)
    assert requests.search("mug", "", "a flat") == ("Looking for: mug.", 8)
    joined = requests.search("hat", "", "a flat", joins=first.goal_id)
    assert joined == ("Looking for: hat, in one tour.", 9)
    assert requests.joins == [None, None, 7]


def test_a_verdict_names_the_find_of_a_tour_that_is_shown():
    requests = Requests()
    requests.confirm_find(3)
    requests.reject_find(4)
    requests.confirm_find()
    assert requests.feedback == [
        ("confirm", 3, None), ("reject", 4, None), ("confirm", None, None)
    ]  # fmt: skip


def test_a_verdict_names_one_of_several_finds_by_its_number():
    requests = Requests()
    requests.confirm_find(3, 1)
    requests.reject_find(3, 2)
    assert requests.feedback == [("confirm", 3, 1), ("reject", 3, 2)]


def test_the_recorder_has_more_time_than_it_takes_to_refuse():
    requests = Requests()
    assert requests.record("mark", "") == "Stored with the recording."
    assert requests.timeout_s > recorder.REPLY_S
