from ippon.segmentation.detectors.vocabulary import COCO_80, SAME, Vocabulary


def test_every_other_name_stands_for_a_class_of_coco():
    assert len(COCO_80) == len(set(COCO_80)) == 80
    assert set(SAME) <= set(COCO_80)
    vocabulary = Vocabulary()
    assert vocabulary.class_of("sofa") == COCO_80.index("couch")
    assert vocabulary.cannot_see("mug") is None


def test_what_it_cannot_see_is_said_with_what_can():
    assert Vocabulary().cannot_see("hat") == (
        "this detector knows 80 kinds of thing, and 'hat' is none of them; an open-vocabulary "
        "network takes any word: --segmentation.backend san, clipseg or owlv2"
    )
    assert "teddy_bear" in (Vocabulary().cannot_see("teddy_bears") or "")
