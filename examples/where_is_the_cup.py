"""Map a recorded sequence, and ask where the cup is."""

import argparse
from pathlib import Path

from app.recognition.frames import open_source
from app.recognition.recognition import Recognition, in_own_world
from ippon.segmentation.config import SegmentationConfig
from ippon.segmentation.loading import load_segmenter

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("folder", type=Path, help="folder of the sequence, or a bag")
parser.add_argument("detector", help="file of a detector, ONNX or ncnn")
parser.add_argument("--track", action="store_true", help="find the poses by the images")
said = parser.parse_args()
detector = load_segmenter(SegmentationConfig(backend="detector", model=said.detector), Path())
recognition, source = Recognition(["cup"]), open_source(said.folder, track=said.track)
for frame in source.frames():
    recognition.add(frame, detector.segment(frame.color, recognition.labels, None))
for find in in_own_world(recognition, "cup", source.T_map_world):
    x, y, z = find.position_world
    print(f"cup: p = {find.probability:.2f} at ({x:.2f}, {y:.2f}, {z:.2f}) m")
