"""Networks that segment images: label probabilities per pixel, or instances.

The entry is `loading.load_segmenter`. Reading order: `segmenter` (the interface), `config`,
`loading`, `backends` (open-vocabulary networks), `detectors` (closed-vocabulary networks from
files), `crop_segmenter` (a second pass), `instances` and `instance_heatmap` (boxes to pixels),
`compact_heatmap` (heatmaps on the wire).
"""
