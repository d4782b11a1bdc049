"""A pair of meshes laid out once answers as the trees do."""

import copy
import pickle
from threading import Thread

import numpy as np
import pytest

import borecheck as bc
from borecheck.core.se3 import transform
from borecheck.errors import GeometryError, UnknownNameError, UsageError
from borecheck.geometry.mesh.primitives import box


@pytest.fixture(scope="module")
def pair():
    return bc.Pair(box("a", (0.3, 0.2, 0.1)), box("b", (0.1, 0.1, 0.5)))


def placed(rng):
    return transform(rng.uniform(-0.3, 0.3, 3), rng.uniform(-3, 3, 3))


@pytest.mark.parametrize("test", ["exact", "two-sided", "paper:robot", "paper:scanner"])
def test_answers_are_those_of_the_trees(pair, test, rng):
    seen = set()
    for _ in range(300):
        T_a, T_b = placed(rng), placed(rng)
        expected = pair.a.first_contact(pair.b, T_a, T_b, test)
        assert pair.first_contact(T_a, T_b, test) is expected
        seen.add(expected)
    assert seen == {True, False}


def test_other_questions_are_asked_of_the_trees(pair, rng):
    T_a, T_b = placed(rng), placed(rng)
    a, b = pair.a, pair.b
    np.testing.assert_array_equal(pair.contacts(T_a, T_b), a.contacts(b, T_a, T_b))
    assert pair.clearance(T_a, T_b, 0.1) == a.clearance(b, T_a, T_b, 0.1)
    assert pair.within(T_a, T_b, 0.2) == a.within(b, T_a, T_b, 0.2)
    assert pair.closest(T_a, T_b).distance == a.closest(b, T_a, T_b).distance


def test_placements_of_any_kind_are_understood_or_refused(pair):
    far = np.eye(4)
    far[0, 3] = 2.0
    assert not pair.first_contact(np.eye(4).tolist(), far)
    assert not pair.first_contact(np.eye(4), np.asfortranarray(far))
    assert not pair.first_contact(np.eye(4, dtype=int), far)
    assert not pair.first_contact(np.eye(8)[::2, ::2], far)
    assert pair.first_contact(np.eye(4), np.eye(4))
    bad = np.eye(4)
    bad[0, 0] = 2.0
    for T in (
        bad,
        np.full((4, 4), np.nan),
        np.eye(3),
        np.eye(4).ravel(),
        np.zeros((4, 4)),
    ):
        with pytest.raises(GeometryError):
            pair.first_contact(T, far)
        with pytest.raises(GeometryError):
            pair.first_contact(far, T)
        with pytest.raises(GeometryError):
            pair.place(far, T)
    with pytest.raises(UnknownNameError):
        pair.first_contact(far, far, "coal")


def test_placed_once_and_asked_often(rng):
    pair = bc.Pair(box("a", (0.3, 0.2, 0.1)), box("b", (0.1, 0.1, 0.5)))
    with pytest.raises(UsageError, match="place"):
        pair.meets()
    seen = set()
    for _ in range(60):
        T_a, T_b = placed(rng), placed(rng)
        pair.place(T_a, T_b)
        assert pair.meets() is pair.meets() is pair.a.first_contact(pair.b, T_a, T_b)
        seen.add(pair.meets())
    assert seen == {True, False}
    # A call that is refused leaves nothing behind that could be taken for an answer.
    with pytest.raises(GeometryError):
        pair.first_contact(np.zeros((4, 4)), T_b)
    with pytest.raises(UsageError):
        pair.meets()


def test_another_thread_gets_the_same_answers_and_cannot_move_the_meshes(pair, rng):
    T_a, T_b = placed(rng), placed(rng)
    far = np.eye(4)
    far[0, 3] = 3.0
    pair.place(np.eye(4), np.eye(4))
    told = []

    def ask():
        told.append(pair.first_contact(far, np.eye(4)))
        told.append(pair.first_contact(T_a, T_b))
        for refused in (pair.meets, lambda: pair.place(far, far)):
            try:
                refused()
            except UsageError as error:
                told.append(str(error))

    thread = Thread(target=ask)
    thread.start()
    thread.join()
    assert told[:2] == [False, pair.a.first_contact(pair.b, T_a, T_b)]
    assert len(told) == 4
    assert pair.meets()


@pytest.mark.parametrize(
    "copied", [copy.copy, copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))]
)
def test_a_copy_looks_at_its_own_placements(copied):
    """It read those of the original: apart, whatever it was asked."""
    pair = bc.Pair(box("a", (0.3, 0.2, 0.1)), box("b", (0.1, 0.1, 0.5)))
    far = transform((2.0, 0.0, 0.0))
    assert not pair.first_contact(far, np.eye(4))
    twin = copied(pair)
    assert twin.first_contact(np.eye(4), np.eye(4))
    twin.place(np.eye(4), np.eye(4))
    pair.place(far, np.eye(4))
    assert twin.meets()
    assert not pair.meets()
