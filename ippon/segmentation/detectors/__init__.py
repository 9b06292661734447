"""Closed-vocabulary detectors from ONNX and ncnn files; the entry is `detector.Detector`."""
