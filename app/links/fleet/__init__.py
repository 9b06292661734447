"""All navigators on a router: which there are, and which of them gets a search."""
