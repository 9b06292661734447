"""Connections to other programs: zenoh network, robot streams, language models, model hub."""
