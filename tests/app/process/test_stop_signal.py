import os
import signal
import threading
import time

import pytest

from app.process.stop_signal import ProcessStopSignal


@pytest.fixture
def stop():
    before = {n: signal.getsignal(n) for n in (signal.SIGINT, signal.SIGTERM)}
    yield ProcessStopSignal()
    for number, handler in before.items():
        signal.signal(number, handler)


def test_a_signal_ends_the_wait_at_once(stop: ProcessStopSignal) -> None:
    threading.Timer(0.05, os.kill, (os.getpid(), signal.SIGTERM)).start()
    began = time.monotonic()
    assert stop.wait(20.0)
    assert time.monotonic() - began < 10.0
    assert stop.is_set()


def test_a_storm_of_signals_does_not_block(stop: ProcessStopSignal) -> None:
    for _ in range(2000):
        os.kill(os.getpid(), signal.SIGTERM)
        os.kill(os.getpid(), signal.SIGINT)
        stop.wait(0.0)
    assert stop.is_set()


def test_without_a_signal_the_wait_runs_out(stop: ProcessStopSignal) -> None:
    assert not stop.wait(0.01)
    assert not stop.is_set()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_work_that_looks_at_no_flag_is_interrupted(number: int, stop: ProcessStopSignal) -> None:
    timer = threading.Timer(0.05, os.kill, (os.getpid(), number))

    def work() -> None:
        timer.start()
        time.sleep(20.0)

    with pytest.raises(KeyboardInterrupt), stop.interrupting():
        work()
    assert stop.is_set()


def test_after_such_work_a_signal_sets_the_flag_only(stop: ProcessStopSignal) -> None:
    with stop.interrupting():
        pass
    os.kill(os.getpid(), signal.SIGTERM)
    assert stop.wait(20.0)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_an_interruption_that_a_destructor_swallows_is_raised_at_the_end(
    stop: ProcessStopSignal,
) -> None:
    class Dropped:
        def __del__(self) -> None:
            os.kill(os.getpid(), signal.SIGTERM)
            for _ in range(1000):
                pass

    done: list[str] = []

    def work() -> None:
        dropped = Dropped()
        del dropped
        done.append("all of it")

    with pytest.raises(KeyboardInterrupt), stop.interrupting():
        work()
    assert done == ["all of it"]


def test_work_does_not_begin_after_a_signal(stop: ProcessStopSignal) -> None:
    stop.set()
    with pytest.raises(KeyboardInterrupt), stop.interrupting():
        pytest.fail("it began")
