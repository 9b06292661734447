"""The product built on `ippon`: nodes, console, recorder, review and the command line."""
