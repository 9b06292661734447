"""Commands that ask the navigator something and change nothing."""
