"""One file a format. A format writes contents of a report and knows no part of it."""
