"""Evidence of the object from beyond the map's range; the entry is `far_evidence.FarEvidence`.

Reading order: `image_columns` (scores of an image), `evidence_grid` (floor grid), `far_evidence`.
"""
