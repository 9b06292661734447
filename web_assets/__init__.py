"""The page that the console serves: HTML, CSS and JavaScript."""
