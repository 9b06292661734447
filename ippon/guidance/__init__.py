"""Guidance: the proximity level of every common object to the goal, each with its reason.

The entry is `prior.EmbeddedPrior.levels`. Reading order: `levels`, `knowledge` (the table),
`rating`, `language` (names and contexts), `context_rating`, `prior`, `prompts` (for language
models).
"""
