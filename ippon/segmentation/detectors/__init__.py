"""Detectors with a fixed list of kinds of thing, from ONNX and ncnn files."""
