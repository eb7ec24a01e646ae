"""What a shell completes."""

import os
import subprocess
import sys

import pytest

CASES = {
    "commands": ("daebench comp", "compare"),
    "problems": ("daebench run spherical_", "spherical_pendulum"),
    "cases": ("daebench run spherical_pendulum --case fig1.", "fig1.2"),
    "methods": ("daebench compare spherical_pendulum --methods rattle,symplectic_", "rattle,symplectic_euler"),
}


@pytest.mark.sampled(left_out=("problems", "cases"))
@pytest.mark.parametrize(("words", "name"), CASES.values(), ids=CASES)
def test_names_are_completed(words, name):
    asked = {"_DAEBENCH_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(len(words.split()) - 1)}
    code = "from daebench.cli.__main__ import main; import sys; sys.argv[0] = 'daebench'; main()"
    completed = subprocess.run([sys.executable, "-c", code], env=os.environ | asked, capture_output=True, text=True, check=False)
    assert name in completed.stdout.split(), completed.stderr
