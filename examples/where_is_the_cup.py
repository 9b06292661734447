"""Map a recorded sequence, and ask where the cup is: FOLDER DETECTOR [--track]."""

import sys
from pathlib import Path

from app.recognition.frames import open_source
from app.recognition.recognition import Recognition, in_own_world
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.loading import load_segmenter

folder, model = map(Path, sys.argv[1:3])
detector = load_segmenter(SegmentationConfig(backend="detector", model=str(model)), Path())
recognition, source = Recognition(["cup"]), open_source(folder, track="--track" in sys.argv)
for frame in source.frames():
    recognition.add(frame, detector.segment(frame.color, recognition.labels, None))
for find in in_own_world(recognition, "cup", source.T_map_world):
    x, y, z = find.position_world
    print(f"cup: p = {find.probability:.2f} at ({x:.2f}, {y:.2f}, {z:.2f}) m")
