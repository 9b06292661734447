"""Segmentation networks, one module or package each: SAN, CLIPSeg, OWLv2 with SAM.

To add a backend, write a `Segmenter` here, name it in `config.Backend` and load it in `loading.py`.
"""
