"""The example of docs/statistics.md runs and says what the page says."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "statistics.md"


def test_the_example_runs_as_the_page_says():
    code = re.search(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert code is not None
    names: dict = {}
    exec(compile(code[1], str(PAGE), "exec"), names)
    best = names["best"]
    assert best["best"].tolist() == ["off", "off", "full", "full"]
    assert best["verdict"].tolist()[0] == best["verdict"].tolist()[-1] == "clear"
    assert "tie" in best["verdict"].tolist()
    # All that off adds is its wait; what full adds are the falls, the same at every delay.
    gain = names["gain"]["difference"].to_numpy()
    assert ((gain[:-1] - gain[1:]).round(9) == [120.0, 180.0, 300.0]).all()
    assert len(names["cells"]) == 8
