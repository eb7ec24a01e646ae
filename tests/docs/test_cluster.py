"""The page on clusters: its certificates and its program make a cluster behind TLS, whose rows are those of this machine."""

import re
import shutil
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest
import said

pytest.importorskip("distributed", reason="the extra scale is not installed")

pytestmark = [pytest.mark.slow, pytest.mark.skipif(shutil.which("openssl") is None, reason="there is no openssl to make certificates with")]


@pytest.fixture
def folder(tmp_path):
    """A folder with the program of the page, and the certificates that its commands make."""
    (tmp_path / "cluster.py").write_text(said.block("cluster.py"), encoding="utf-8")
    done = said.call(said.block("certificates", "sh"), tmp_path)
    assert done.returncode == 0, done.stderr
    return tmp_path


@contextmanager
def started(folder):
    """Start the program with processes of this machine, and give the address that it prints."""
    pipe = subprocess.PIPE
    with subprocess.Popen([sys.executable, "cluster.py", "local"], cwd=folder, stdin=pipe, stdout=pipe, stderr=pipe, text=True) as program:
        try:
            yield program.stdout.readline().strip()
        finally:
            program.communicate("\n")


def command(folder, address, out):
    """Return the command of the page with this address and folder, and with fewer and shorter runs."""
    page = (said.DOCS / "how-to" / "cluster.md").read_text(encoding="utf-8")
    line = re.search(r"^\$ (daebench ensemble .*\\\n.*)$", page, re.MULTILINE)[1]
    for given, less in (("1e5", "0.1"), ("16384", "300"), ("--out swings", f"--out {out}"), (r"tls://\S+", address)):
        line, found = re.subn(given, less, line)
        assert found == 1
    return line


@pytest.mark.exhaustive
def test_the_cluster_of_the_page_computes_the_rows_of_this_machine(folder):
    with started(folder) as address:
        assert address.startswith("tls://")
        there = said.call(command(folder, address, "there"), folder)
        assert there.returncode == 0, there.stderr
        stranger = said.call(re.sub(r" --tls.*", "", command(folder, address.replace("tls:", "tcp:"), "nowhere")), folder)
        assert stranger.returncode == 2
        assert "there is no Dask scheduler at" in stranger.stderr
    here = said.call(re.sub(r"\\\n.*", "", command(folder, address, "here")), folder)
    assert here.returncode == 0, here.stderr
    rows = [(folder / out / "ends.csv").read_text(encoding="utf-8").splitlines() for out in ("here", "there")]
    assert len(rows[0]) == 301
    assert rows[0] == rows[1]


@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning", "ignore::pytest.PytestUnraisableExceptionWarning")
def test_the_jobs_of_the_page_are_workers_behind_tls(folder):
    """The script that SLURM is given starts workers that show the certificate; here a program of the same name only says a number."""
    pytest.importorskip("dask_jobqueue")
    sbatch = folder / "bin" / "sbatch"
    sbatch.parent.mkdir()
    sbatch.write_text(f'#!/bin/sh\ncp "$1" {folder}/job.sh\necho Submitted batch job 7\n')
    sbatch.chmod(0o755)
    (sbatch.parent / "scancel").symlink_to("/bin/true")
    show = "import cluster, time\nwith cluster.cluster():\n    time.sleep(2)\n"
    done = said.call(f"PATH={sbatch.parent}:$PATH python -c '{show}'", folder)
    assert done.returncode == 0, done.stderr
    script = Path(folder / "job.sh").read_text(encoding="utf-8")
    assert "#SBATCH -p normal" in script
    assert "#SBATCH --cpus-per-task=16" in script
    worker = script.splitlines()[-1]
    assert all(word in worker for word in ("--nthreads 1", "--nworkers 16", "--tls-ca-file", f"{folder.resolve()}/me.pem"))
    assert " tls://" in worker
