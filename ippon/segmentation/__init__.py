"""Label probabilities per pixel, from open-vocabulary segmentation networks.

The entry is `loading.load_segmenter`. Reading order: `segmenter` (the interface), `config`,
`loading`, `backends` (the networks), `crop_segmenter` and `distractors` (second passes),
`compact_heatmap` (the heatmap as it is sent), `instances` and `painting` (boxes to pixels),
`detectors` (networks from files).
"""
