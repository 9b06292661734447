"""One search, from the first frame to the find: the loop that reads like the paper."""
