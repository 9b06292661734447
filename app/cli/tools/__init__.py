"""Commands that do one thing and exit: ask, measure, convert, check."""
