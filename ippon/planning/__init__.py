"""The tree of viewpoints and the paths between them."""
