"""Map a recorded sequence, and ask where the cup is: FOLDER DETECTOR [--track]."""

import sys
from pathlib import Path

from app.recognition.frames import open_source
from app.recognition.recognition import Recognition
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.loading import load_segmenter

folder, model = map(Path, sys.argv[1:3])
detector = load_segmenter(SegmentationConfig(backend="detector", model=str(model)), Path())
recognition = Recognition(["cup"])
for frame in open_source(folder, track="--track" in sys.argv).frames():
    recognition.add(frame, detector.segment(frame.color, recognition.labels, None))
for find in recognition.finds("cup"):
    print(f"cup: p = {find.probability:.2f} at {find.position_world} m")
