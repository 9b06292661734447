"""Detectors from files: `nanodet` runs ncnn files, `vocabulary` names what they can tell."""
