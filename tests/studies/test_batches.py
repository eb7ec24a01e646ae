"""Cells handed out: quick ones many at a time, slow ones one by one, and nothing that was done is lost with what was not."""

import os
import subprocess
import sys
import time
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from importlib.util import find_spec
from types import SimpleNamespace

import pytest
from refusals import refused

from daebench.errors import DaebenchError
from daebench.records.code import code_version
from daebench.records.rows import StoredRow
from daebench.records.store import opened
from daebench.studies.grid import runs as grid_runs
from daebench.studies.grid.run_specification import GridRun
from daebench.studies.grid.runs import computed
from daebench.studies.grid.schedulers import dask_cluster, workers_of


def specifications(n):
    given = {"problem": "planar_pendulum", "case": "rotating", "method": "rattle", "t_end": 4.0, "metrics": ("energy",)}
    return [GridRun(**given, value=1 / (16 + k)) for k in range(n)]


class AtOnce(Executor):
    """Computes what is submitted when it is submitted, by this function, and keeps how many runs each share had."""

    def __init__(self, rows_of):
        self.rows_of, self.sizes, self._max_workers = rows_of, [], 2

    def submit(self, fn, batch, maker):
        self.sizes.append(len(batch))
        future = Future()
        try:
            future.set_result(self.rows_of(batch, maker))
        except BrokenExecutor as error:
            future.set_exception(error)
        return future


def taking(seconds):
    """Return what computes rows that tell their step sizes, and says that each took so long."""
    return lambda batch, maker: tuple(
        StoredRow(key, specification.plain(), {"value": specification.value}, maker, seconds) for key, specification in batch
    )


@pytest.fixture
def store(tmp_path):
    with opened(tmp_path / "rows.db") as found:
        yield found


def test_quick_cells_go_out_many_at_a_time_and_the_last_of_them_are_divided(store):
    executor = AtOnce(taking(1e-4))
    found = computed(specifications(1000), store, executor=executor)
    assert [row["value"] for row in found.values()] == [specification.value for specification in specifications(1000)]
    assert (executor.sizes[0], max(executor.sizes), sum(executor.sizes)) == (1, grid_runs.MOST, 1000)
    assert executor.sizes[-1] == 1
    assert len(executor.sizes) < 50


def test_a_share_takes_about_a_moment(store):
    executor = AtOnce(taking(grid_runs.MOMENT / 10))
    computed(specifications(200), store, executor=executor)
    assert max(executor.sizes) == 10


def test_what_was_done_before_a_loss_is_kept(store):
    def lose_the_first(batch, maker):
        if batch[0][1].value == 1 / 16:
            raise BrokenExecutor
        return taking(1.0)(batch, maker)

    with refused("worker-lost", DaebenchError):
        computed(specifications(20), store, executor=AtOnce(lose_the_first))
    assert len(store) == 2 * grid_runs.AHEAD - 1


def test_a_worker_of_another_version_is_refused(store):
    with refused("worker-of-other-version"):
        grid_runs.rows_of([("key", specifications(1)[0])], "something else")
    (found,) = grid_runs.rows_of([("key", specifications(1)[0])], code_version())
    assert (found.key, found.row["failure"], found.maker) == ("key", "", code_version())
    assert found.took > 0


def test_an_executor_tells_how_many_it_computes_at_a_time():
    cluster = SimpleNamespace(_client=SimpleNamespace(nthreads=lambda: {"one": 4, "two": 8}))
    with ThreadPoolExecutor(3) as pool:
        assert [workers_of(each) for each in (pool, cluster, SimpleNamespace(num_workers=7))] == [3, 12, 7]


ENDED = """
import os, signal
from daebench.studies.grid.schedulers import local_processes
if __name__ == "__main__":
    with local_processes(2) as pool:
        print(*{pool.submit(os.getpid).result() for _ in range(20)}, flush=True)
        os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_processes_end_with_the_one_that_began_them_though_it_is_killed(tmp_path):
    (tmp_path / "program.py").write_text(ENDED)
    path = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)}
    done = subprocess.run([sys.executable, tmp_path / "program.py"], env=path, capture_output=True, text=True, check=False, timeout=120)
    begun = list(map(int, done.stdout.split()))
    assert begun
    deadline = time.monotonic() + 60
    while any(map(_runs, begun)):
        assert time.monotonic() < deadline, f"{begun} still run"
        time.sleep(0.05)


def _runs(process):
    try:
        os.kill(process, 0)
    except ProcessLookupError:
        return False
    return True


class Client:
    """A client of a cluster whose workers tell this of the module that they are asked for."""

    def __init__(self, told):
        self.told, self.closed = told, False

    def wait_for_workers(self, count, timeout):
        if len(self.told) < count:
            raise TimeoutError

    def run(self, function, name, on_error):
        return self.told

    def get_executor(self, pure):
        return self

    def close(self):
        self.closed = True


FOUND = find_spec("json")
CLUSTERS = {
    "none": ("cluster-without-workers", {}),
    "fails": ("worker-without-daebench", {"b": FOUND, "c": ModuleNotFoundError()}),
    "not-there": ("worker-without-daebench", {"b": FOUND, "c": None}),
}


@pytest.mark.parametrize(("code", "told"), CLUSTERS.values(), ids=CLUSTERS)
def test_a_cluster_that_cannot_compute_is_refused(monkeypatch, code, told):
    client = Client(told)
    monkeypatch.setitem(sys.modules, "distributed", SimpleNamespace(Client=lambda *_, **__: client))
    with refused(code), dask_cluster("tcp://a:1"):
        pass
    assert client.closed
    client.told = {"b": FOUND}
    with dask_cluster("tcp://a:1") as executor:
        assert executor is client


class Deserted(Executor):
    """A cluster that computes so many batches, and then has no worker, for ever or for so many looks."""

    def __init__(self, computes, looks=10**9):
        self.computes, self.looks, self.waiting = computes, looks, []
        self._client = self
        self._rows_of = taking(1.0)

    def nthreads(self):
        if self.computes > 0 or self.looks == 0:
            for future, words in self.waiting:
                future.set_result(self._rows_of(*words))
            self.waiting = []
            return {"tcp://b:2": 1}
        self.looks -= 1
        return {}

    def submit(self, fn, *words):
        future = Future()
        if self.computes > 0:
            self.computes -= 1
            future.set_result(self._rows_of(*words))
        else:
            self.waiting.append((future, words))
        return future


def test_a_cluster_that_loses_its_workers_is_given_up_after_a_while_and_its_rows_are_kept(store, monkeypatch):
    monkeypatch.setattr(grid_runs, "GLANCE", 0.01)
    monkeypatch.setattr(grid_runs, "UNATTENDED_SECONDS", 0.2)
    executor = Deserted(2)
    with pytest.warns(UserWarning, match=r"waiting 0\.2 s"), refused("cluster-lost-workers", DaebenchError):
        computed(specifications(12), store, executor=executor)
    assert len(store) == 2
    assert all(future.cancelled() for future, _ in executor.waiting)


def test_a_cluster_that_gets_a_worker_again_goes_on(store, monkeypatch):
    monkeypatch.setattr(grid_runs, "GLANCE", 0.01)
    with pytest.warns(UserWarning, match="waiting"):
        computed(specifications(2), store, executor=Deserted(1, 2))
    assert len(store) == 2
