"""The page's template, styles and scripts, all put into one file (``formats/html.py``)."""
