"""The lease, with time as an argument."""

import itertools
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from app.messages.lease import Credential, sender_of
from app.nodes.navigator.state.lease import EXPIRY_S, STALE_S, Lease

ANNA = Credential(session="anna" * 5, name="Anna")
BERT = Credential(session="bert" * 5, name="Bert")
CARL = Credential(session="carl" * 5, name="Carl")


def of_epoch(who: Credential, epoch: int) -> Credential:
    return Credential(session=who.session, name=who.name, epoch=epoch)


@pytest.fixture
def lease() -> Lease:
    return Lease()


@pytest.fixture
def held(lease: Lease) -> Lease:
    """Anna holds, with epoch 1, since 0."""
    assert lease.request(ANNA, 0.0).standing == "holds"
    lease.take_events()
    return lease


ANNA_1 = of_epoch(ANNA, 1)


def test_what_is_free_is_taken(lease: Lease) -> None:
    assert lease.status(0.0).state == "free"
    reply = lease.request(ANNA, 0.0)
    assert (reply.standing, reply.epoch, reply.detail) == ("holds", 1, "You have control.")
    status = lease.status(0.0)
    assert (status.state, status.holder, status.epoch) == ("held", "Anna", 1)
    assert lease.take_events() == ("Anna took control",)
    assert lease.take_events() == ()


def test_while_it_is_free_every_command_counts(lease: Lease) -> None:
    assert lease.refusal(None, 0.0) is None
    assert lease.refusal(ANNA, 0.0) is None
    assert (
        lease.teleop_refusal(sender_of(ANNA.session), 0, 0.0)
        == "nobody has control: take it to drive"
    )


def test_the_holders_commands_count_and_nobody_elses(held: Lease) -> None:
    assert held.refusal(ANNA_1, 0.1) is None
    assert held.teleop_refusal(sender_of(ANNA.session), 1, 0.1) is None
    refused = (
        "Anna has control: request it, wait until it is released, or take it (ippon ask --take)"
    )
    assert held.refusal(None, 0.1) == refused
    assert held.refusal(of_epoch(BERT, 1), 0.1) == refused
    assert held.teleop_refusal(sender_of(BERT.session), 1, 0.1) == "Anna has control"


def test_an_old_epoch_counts_no_more(held: Lease) -> None:
    held.release(ANNA_1, 0.1)
    assert held.request(ANNA, 0.2).epoch == 2
    assert "ended" in str(held.refusal(ANNA_1, 0.3))
    assert held.teleop_refusal(sender_of(ANNA.session), 1, 0.3) == "this lease has ended"
    assert held.teleop_refusal(sender_of(ANNA.session), 2, 0.3) is None


def test_the_secret_of_the_holder_is_no_sender(held: Lease) -> None:
    # Who watches the driving messages must not learn what the lease is commanded with.
    assert held.teleop_refusal(ANNA.session, 1, 0.1) == "Anna has control"
    assert held.refusal(Credential(session=sender_of(ANNA.session), name="x", epoch=1), 0.1)


def test_renewals_keep_it_and_silence_ends_it(held: Lease) -> None:
    for tick in range(1, 21):
        assert held.renew(ANNA_1, 0.5 * tick).standing == "holds"
    last = 10.0
    assert held.status(last + STALE_S).state == "held"
    assert held.status(last + STALE_S + 0.01).state == "stale"
    assert held.refusal(ANNA_1, last + EXPIRY_S) is None
    assert held.status(last + EXPIRY_S + 0.01).state == "free"
    assert held.take_events() == ("Anna is gone: the lease expired",)
    assert held.renew(ANNA_1, last + 3.0).standing == "watches"
    assert held.teleop_refusal(sender_of(ANNA.session), 1, last + 3.0) is not None


def test_asking_shows_and_the_holder_grants(held: Lease) -> None:
    reply = held.request(BERT, 0.1)
    assert (reply.standing, reply.detail) == ("waits", "You have asked Anna for control.")
    assert held.status(0.1).requester == "Bert"
    assert held.take_events() == ("Bert asks Anna for control",)
    assert held.grant(ANNA_1, 0.2).standing == "watches"
    reply = held.renew(BERT, 0.3)
    assert (reply.standing, reply.epoch) == ("holds", 2)
    assert held.refusal(of_epoch(BERT, 2), 0.3) is None
    assert held.refusal(ANNA_1, 0.3) is not None
    assert held.take_events() == ("Bert was given control by Anna",)


def test_the_holder_denies_and_may_be_asked_again(held: Lease) -> None:
    held.request(BERT, 0.1)
    assert held.deny(ANNA_1, 0.2).standing == "holds"
    reply = held.renew(BERT, 0.3)
    assert (reply.standing, reply.detail) == ("denied", "Anna keeps control.")
    assert held.status(0.3).requester == ""
    assert held.request(BERT, 0.4).standing == "waits"


def test_one_asks_at_a_time(held: Lease) -> None:
    held.request(BERT, 0.1)
    reply = held.request(CARL, 0.2)
    assert reply.standing == "watches"
    assert reply.detail == "Anna has control, and Bert asks for it already."


def test_whoever_asks_in_vain_and_leaves_is_forgotten_after_ten_seconds(held: Lease) -> None:
    held.request(BERT, 0.0)
    for tick in range(1, 11):
        held.renew(ANNA_1, float(tick))
    assert held.status(10.0).requester == "Bert"
    assert held.status(10.01).requester == ""
    assert held.status(10.2).requester == ""
    assert held.request(CARL, 10.3).standing == "waits"


def test_who_withdraws_waits_no_more(held: Lease) -> None:
    held.request(BERT, 0.1)
    assert held.release(BERT, 0.2).standing == "watches"
    assert held.status(0.2).requester == ""


@pytest.mark.parametrize("how", ["release", "silence"])
def test_who_waits_follows_on_the_holder(held: Lease, how: str) -> None:
    held.request(BERT, 1.5)
    if how == "release":
        held.release(ANNA_1, 1.6)
    reply = held.renew(BERT, 2.5)
    assert (reply.standing, reply.epoch) == ("holds", 2)


def test_nobody_follows_who_has_left_too(held: Lease) -> None:
    held.request(BERT, 0.1)
    assert held.status(11.0).state == "free"


def test_a_supervisor_takes_it(held: Lease) -> None:
    held.request(BERT, 0.1)
    assert held.take(CARL, 0.2).epoch == 2
    assert str(held.refusal(ANNA_1, 0.2)).startswith("Carl has control: request it")
    assert held.status(0.2).requester == "Bert"
    assert held.take_events()[-1] == "Carl took control from Anna"
    assert held.take(of_epoch(CARL, 2), 0.3).epoch == 2, "taking one's own changes nothing"


@pytest.mark.parametrize("action", ["release", "grant", "deny", "renew"])
def test_others_change_nothing(held: Lease, action: str) -> None:
    held.request(CARL, 0.1)
    getattr(held, action)(of_epoch(BERT, 1), 0.2)
    status = held.status(0.2)
    assert (status.holder, status.requester, status.epoch) == ("Anna", "Carl", 1)


def test_a_reply_that_was_lost_is_asked_for_again(held: Lease) -> None:
    assert held.request(ANNA, 0.5).epoch == 1
    assert held.renew(ANNA, 0.6) == held.request(ANNA, 0.6)


def test_a_request_after_a_silence_of_two_seconds_is_a_lease_at_once(held: Lease) -> None:
    assert held.refusal(BERT, 2.0) is not None
    reply = held.request(BERT, 2.01)
    assert (reply.standing, reply.epoch) == ("holds", 2)
    assert held.take_events() == ("Anna is gone: the lease expired", "Bert took control")


def test_a_lease_is_stale_after_one_second(held: Lease) -> None:
    assert [held.status(t).state for t in (0.9, 1.0, 1.01, 2.0, 2.01)] == [
        "held", "held", "stale", "stale", "free",
    ]  # fmt: skip


@pytest.mark.parametrize("again", ["request", "renew"])
def test_the_holder_and_the_requester_are_kept_by_whatever_they_send(
    held: Lease, again: str
) -> None:
    held.request(BERT, 0.1)
    for tick in range(1, 13):
        getattr(held, again)(ANNA_1, 1.5 * tick)
        if tick == 6:
            assert getattr(held, again)(BERT, 9.0).standing == "waits"
    status = held.status(18.0)
    assert (status.state, status.requester) == ("held", "Bert")


def test_a_silent_holder_drives_no_longer(held: Lease) -> None:
    assert held.teleop_refusal(sender_of(ANNA.session), 1, 2.0) is None
    assert (
        held.teleop_refusal(sender_of(ANNA.session), 1, 2.01)
        == "nobody has control: take it to drive"
    )


def test_a_silent_holder_neither_refuses_nor_is_taken_from(held: Lease) -> None:
    assert held.refusal(BERT, 2.01) is None
    held.request(ANNA, 2.02)
    held.take_events()
    held.take(CARL, 4.03)
    assert held.take_events() == ("Anna is gone: the lease expired", "Carl took control")


def test_who_was_denied_and_withdraws_a_second_request_just_watches(held: Lease) -> None:
    held.request(BERT, 0.1)
    held.deny(ANNA_1, 0.2)
    held.request(BERT, 0.3)
    reply = held.release(BERT, 0.4)
    assert (reply.standing, reply.detail) == ("watches", "Anna has control.")


def test_a_denial_ends_with_the_lease_of_who_denied(held: Lease) -> None:
    held.request(BERT, 0.1)
    held.deny(ANNA_1, 0.2)
    held.take(CARL, 0.3)
    assert held.renew(BERT, 0.4).detail == "Carl has control."


@pytest.mark.parametrize("how", ["grant", "take"])
def test_who_gets_control_asks_for_it_no_longer(held: Lease, how: str) -> None:
    held.request(BERT, 0.1)
    getattr(held, how)(ANNA_1 if how == "grant" else BERT, 0.2)
    status = held.status(0.2)
    assert (status.holder, status.requester) == ("Bert", "")


def test_each_change_is_one_event(held: Lease) -> None:
    held.request(BERT, 0.1)
    held.deny(ANNA_1, 0.2)
    held.request(BERT, 0.3)
    held.release(BERT, 0.4)
    held.release(ANNA_1, 0.5)
    assert held.take_events() == (
        "Bert asks Anna for control",
        "Anna keeps control; Bert had asked",
        "Bert asks Anna for control",
        "Bert no longer asks for control",
        "Anna released control",
    )


ACTIONS = ("request", "renew", "release", "grant", "deny", "take")
PEOPLE = (ANNA, BERT, CARL)


def steps_of(*actions: str) -> st.SearchStrategy[list[tuple[str, int, float, bool]]]:
    step = st.tuples(
        st.sampled_from(actions), st.integers(0, 2), st.floats(0.0, 3.0), st.booleans()
    )
    return st.lists(step, max_size=40)


@settings(max_examples=50)
@given(steps_of(*ACTIONS, "refusal"))
def test_reading_the_state_never_changes_what_follows(
    steps: list[tuple[str, int, float, bool]],
) -> None:
    read, unread = Lease(), Lease()
    now = 0.0
    for action, person, wait, is_current in steps:
        now += wait
        status = read.status(now)
        assert read.status(now) == status
        who = of_epoch(PEOPLE[person], status.epoch if is_current else 0)
        assert getattr(read, action)(who, now) == getattr(unread, action)(who, now)
        assert read.take_events() == unread.take_events()


@settings(max_examples=50)
@given(steps_of(*ACTIONS))
def test_whatever_happens_one_at_most_commands(steps: list[tuple[str, int, float, bool]]) -> None:
    lease = Lease()
    epochs: dict[str, int] = {}
    now, last_epoch = 0.0, 0
    for action, person, wait, remembers in steps:
        now += wait
        who = PEOPLE[person]
        epoch = epochs.get(who.name, 0) if remembers else 0
        reply: Any = getattr(lease, action)(of_epoch(who, epoch), now)
        status = lease.status(now)
        if reply.standing == "holds":
            epochs[who.name] = reply.epoch
            assert status.holder == who.name
        assert status.epoch >= last_epoch
        last_epoch = status.epoch
        if status.state != "free":
            allowed = [
                (p.name, e)
                for p, e in itertools.product(PEOPLE, range(status.epoch + 1))
                if lease.refusal(of_epoch(p, e), now) is None
            ]
            assert allowed == [(status.holder, status.epoch)]
            driving = [
                p for p in PEOPLE if not lease.teleop_refusal(sender_of(p.session), last_epoch, now)
            ]
            assert [p.name for p in driving] == [status.holder]
