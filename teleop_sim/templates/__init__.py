"""Object templates: what both sites know of things, where they have put them, and how the two keep in step."""
