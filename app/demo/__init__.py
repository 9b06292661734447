"""The demo: navigator, console, recorder and simulated robot as processes of this machine."""
