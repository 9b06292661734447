"""Evaluation: episodes, methods, metrics and statistics.

Reading order: `episode_generation` (which searches), `trial` (one episode with one method),
`episode_record` and `episode` (the run), `metrics`, `outcome`, `row`, `statistics`, `summary`,
`methods`.
"""
