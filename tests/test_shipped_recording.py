"""The verdict on the real recording that ships: a person pushes a wheelchair over a floor.

In: the excerpts in data/smartwheel, diagnosed as `mjchair diagnose data/smartwheel` does. Out: what
docs/diagnosis.md says of them.
"""

import pytest

import mjchair
from mjchair.diagnosis.data import standstill
from mjchair.measurement import samples


@pytest.fixture(scope="module")
def said():
    return mjchair.diagnose(samples.folder() / "smartwheel")


def test_the_time_before_the_chair_rolls_on_is_left_out():
    """The person moves on it for 1.9 s; what that does to a chair at rest, tires decide."""
    (run,) = mjchair.read_study(samples.folder() / "smartwheel").runs
    assert standstill.rests(run.trial) == [(0.0, pytest.approx(1.89, abs=0.02))]


def test_a_person_who_moves_in_step_with_the_strokes_is_named(said):
    assert (said.verdict, [e.name for e in said.effects]) == ("named", ["rider_motion"])
    assert said.effects[0].closure > 0.9
    assert said.gap.before > 2.0 * said.gap.after


def test_what_was_assumed_is_told(said):
    for told in ("the right one is assumed alike", "until 1.9 s", "the mass alone is not known"):
        assert any(told in note for note in said.notes), told
