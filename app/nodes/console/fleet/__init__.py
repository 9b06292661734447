"""All robots on the router: their list, and a page of each, opened on its first visit."""
