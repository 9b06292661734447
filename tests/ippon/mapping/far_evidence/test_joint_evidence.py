import numpy as np
import pytest

from ippon.mapping.far_evidence.far_evidence import FarEvidence, FarEvidenceConfig
from ippon.mapping.far_evidence.joint_evidence import JointEvidence
from tests.ippon.mapping.far_evidence.test_far_evidence import (
    AHEAD,
    FAR,
    HEADINGS,
    NEAR_M,
    frame_of,
)

HERE = np.zeros((1, 2))


def evidence(label, cues=()):
    result = FarEvidence(FarEvidenceConfig(), label, NEAR_M)
    result.set_cues(cues)
    return result


def test_the_strongest_evidence_for_any_object_counts():
    hat, mug = evidence("hat"), evidence("mug")
    joint = JointEvidence([hat, mug])
    assert not joint.ahead(HERE, HEADINGS, FAR).any()
    before = joint.revision
    for n in range(10):
        hat.integrate(frame_of(AHEAD, stamp_s=0.1 * n))
    assert joint.revision > before
    alone = hat.ahead(HERE, HEADINGS, FAR)
    assert alone.max() > 0.5
    assert (joint.ahead(HERE, HEADINGS, FAR) == alone).all()
    for n in range(10):
        mug.integrate(frame_of(AHEAD, ooi="mug", p=0.5, yaw=1.5, stamp_s=0.1 * n))
    both = np.maximum(hat.ahead(HERE, HEADINGS, FAR), mug.ahead(HERE, HEADINGS, FAR))
    assert (joint.ahead(HERE, HEADINGS, FAR) == both).all()
    assert (both > alone).any()


def test_a_cue_of_any_object_counts():
    parts = [evidence("mug"), evidence("hat", cues=("wall",))]
    for n in range(10):
        parts[1].integrate(frame_of((slice(0, 0), slice(0, 0)), stamp_s=0.1 * n))
    cued = JointEvidence(parts).cued(HERE, HEADINGS, FAR)
    assert (cued == parts[1].cued(HERE, HEADINGS, FAR)).all()
    assert cued.dtype == np.bool_


def test_there_must_be_an_object():
    with pytest.raises(ValueError, match="at least one object"):
        JointEvidence([])
