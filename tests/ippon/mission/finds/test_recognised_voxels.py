"""Voxels of a find that are recognised, and those beside it."""

import numpy as np

from ippon.mission.finds.recognised_voxels import RecognisedVoxels, voxel_keys

CENTRES = np.array(
    [(-4.05, 0.25, 0.95), (4.05, 0.25, 0.95), (0.25, -4.05, 0.95), (0.25, 0.25, 9.95)]
)


def test_equal_voxels_have_equal_keys_and_others_do_not():
    keys = voxel_keys(CENTRES)
    assert len(set(keys.tolist())) == len(CENTRES)
    again = voxel_keys(CENTRES[::-1] + 1e-9)
    assert again.tolist() == keys[::-1].tolist()
    fine = np.array([(0.01, 0.0, 0.0), (0.03, 0.0, 0.0), (0.05, 0.0, 0.0)])
    assert len(set(voxel_keys(fine).tolist())) == 3, "voxels of 2 cm"


def test_a_voxel_that_most_recognising_images_exclude_is_beside_the_object():
    inside, beside, new, mixed = voxel_keys(CENTRES)
    found = RecognisedVoxels()
    assert not found.are_beside(np.array([inside, beside])).any(), "nothing was recognised yet"
    found.add(np.array([inside, beside]), np.array([True, False]))
    found.add(np.array([mixed, inside]), np.array([False, True]))
    found.add(np.array([beside, mixed]), np.array([False, True]))
    keys = np.array([mixed, beside, new, inside])
    assert found.are_beside(keys).tolist() == [False, True, False, False]
