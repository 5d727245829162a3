"""The template of an estimator runs as it stands, with its own tests, after being copied."""

import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[4]
#: A folder of methods beside the toolkit's, and the tests with the toolkit's fixtures.
RUN = """
import sys, pytest
import armimpedance.hand.still.methods as methods
methods.__path__.append(sys.argv[1])
sys.exit(pytest.main(["-q", "-p", "no:cacheprovider", "--rootdir", sys.argv[2], sys.argv[2]]))
"""


def test_a_copied_template_passes_its_own_tests(tmp_path):
    methods, tests = tmp_path / "methods", tmp_path / "tests"
    for folder, name in ((methods, "my_estimator.py"), (tests, "test_my_estimator.py")):
        folder.mkdir()
        shutil.copy(ROOT / "docs/templates" / name, folder / name)
    shutil.copy(ROOT / "tests/conftest.py", tests / "conftest.py")
    shutil.copy(ROOT / "tests/therapy_sessions.py", tests / "therapy_sessions.py")
    call = [sys.executable, "-c", RUN, str(methods), str(tests)]
    ran = subprocess.run(call, capture_output=True, text=True, cwd=tmp_path, check=False)
    assert ran.returncode == 0, ran.stdout + ran.stderr
