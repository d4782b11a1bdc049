from typing import NamedTuple

import pytest

from borecheck.errors import UrdfError
from borecheck.robots.urdf.mimic import Follow, resolve, try_resolve


class Relation(NamedTuple):
    joint: str
    multiplier: float = 1.0
    offset: float = 0.0


class Joint(NamedTuple):
    name: str
    mimic: Relation | None = None


def test_free_joints_are_not_in_the_result():
    assert resolve([Joint("a"), Joint("b")]) == {}


def test_a_chain_is_composed_to_its_free_end():
    joints = [
        Joint("c", Relation("b", -2.0, 0.5)),
        Joint("b", Relation("a", 3.0, 0.25)),
        Joint("a"),
    ]
    follows = resolve(joints)
    assert follows == {"c": Follow("a", -6.0, 0.0), "b": Follow("a", 3.0, 0.25)}
    a = 0.7
    b = 3.0 * a + 0.25
    assert follows["c"].multiplier * a + follows["c"].offset == pytest.approx(
        -2 * b + 0.5
    )


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        ([Joint("a", Relation("a"))], "mimics itself"),
        ([Joint("a", Relation("x"))], "'a' mimics 'x', which is no joint"),
        ([Joint("a", Relation("b")), Joint("b", Relation("a"))], "a -> b -> a"),
    ],
)
def test_what_has_no_meaning_is_refused(joints, words):
    with pytest.raises(UrdfError, match=words):
        resolve(joints)


def test_problems_come_as_values_beside_what_is_sound():
    follows, problems = try_resolve(
        [Joint("a"), Joint("b", Relation("a")), Joint("c", Relation("x"))]
    )
    assert follows == {"b": Follow("a", 1.0, 0.0)}
    assert [(p.joint, p.kind) for p in problems] == [("c", "missing")]
