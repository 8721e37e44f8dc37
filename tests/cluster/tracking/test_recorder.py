"""What becomes of records while the store is away."""

import pytest

from cluster.errors import UserError
from cluster.tracking.recorder import Recorder


class Store:
    """It fails while it is away, and remembers what reached it."""

    def __init__(self):
        self.is_away = False
        self.asked = 0
        self.kept = []

    def keeping(self, number):
        def keep():
            self.asked += 1
            if self.is_away:
                raise UserError("the store is away")
            self.kept.append(number)

        return keep


def test_what_a_store_missed_reaches_it_in_order_once_it_is_back(capsys):
    store, recorder = Store(), Recorder("; the work goes on", pause=0.0)
    recorder.record(store.keeping(1))
    store.is_away = True
    recorder.record(store.keeping(2))
    recorder.record(store.keeping(3))
    assert store.kept == [1]
    store.is_away = False
    recorder.record(store.keeping(4))
    assert store.kept == [1, 2, 3, 4]
    assert capsys.readouterr().err == "the store is away; the work goes on\n"


def test_a_store_that_failed_is_left_alone_for_a_while_and_asked_at_the_end():
    store, recorder = Store(), Recorder("", pause=600.0)
    store.is_away = True
    for number in range(5):
        recorder.record(store.keeping(number))
    assert store.asked == 1
    with pytest.raises(UserError, match="the store is away"):
        recorder.complete()
    store.is_away = False
    recorder.complete()
    assert store.kept == [0, 1, 2, 3, 4]


def test_who_gives_up_waits_only_for_a_store_that_has_not_failed():
    for failed in (False, True):
        store, recorder = Store(), Recorder("", pause=0.0)
        store.is_away = failed
        recorder.record(store.keeping(1))
        store.is_away = False
        recorder.give_up()
        recorder.record(store.keeping(2))
        assert store.kept == ([] if failed else [1, 2])
