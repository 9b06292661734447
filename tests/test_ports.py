"""What tests are given for their servers is theirs alone."""

from tests.ports import free_domain, free_port, own_numbers


def test_no_two_workers_share_a_number():
    numbers = range(1, 100)
    workers = [own_numbers(numbers, worker) for worker in ("", *(f"gw{n}" for n in range(7)))]
    assert sorted(number for own in workers for number in own) == list(numbers)


def test_no_two_tests_of_a_worker_share_one():
    assert len({free_port() for _ in range(500)}) == 500
    assert len({free_domain() for _ in range(6)}) == 6
