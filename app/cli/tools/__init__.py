"""Commands that ask, measure, convert or check, and end."""
