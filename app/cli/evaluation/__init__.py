"""`ippon eval`: options to the evaluation, its progress and results to the terminal."""
