"""The verdict that the program wrote is the one that the package finds from the tables.

usage: check_verdict.py FILE…
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "python"))

from railsqueal import Result  # noqa: E402
from railsqueal.verdict import derived, verdict  # noqa: E402

for path in sys.argv[1:]:
    with Result(path) as result:
        assert "verdict/sentence" in result, f"{path} has no verdict"
        written, found = verdict(result), derived(result)
    assert written == found, f"{path}:\n{written}\n{found}"
    print(written.sentence)
