"""A goal, and what a sentence says of it besides its name: attributes, places, counts, pronouns."""
