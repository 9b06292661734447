"""Network link between the console and the navigator: `navigator_link`, then `panel_requests`."""
