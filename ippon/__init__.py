"""IPPON: common-sense guided informative path planning for object goal navigation.

Map a recorded sequence (TUM RGB-D, 7-Scenes, ScanNet), and ask where the cup is:

    from pathlib import Path
    from app.recognition.frames import open_source
    from app.recognition.recognition import Recognition, in_own_world
    from ippon.segmentation.config import SegmentationConfig
    from ippon.segmentation.loading import load_segmenter

    config = SegmentationConfig(backend="detector", model="nanodet-plus-m_416.param")
    detector, recognition = load_segmenter(config, Path()), Recognition(["cup"])
    source = open_source(Path("recording"))
    for frame in source.frames():
        recognition.add(frame, detector.segment(frame.color, recognition.labels, None))
    print(in_own_world(recognition, "cup", source.T_map_world))
"""
