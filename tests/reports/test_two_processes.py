"""Work of reports in two processes: what it gives, what a failure says, and what becomes of a process that is lost."""

import math
import os
import pickle
from concurrent.futures.process import BrokenProcessPool

import pytest

from daebench.errors import RunFailed
from daebench.pages.report import two_processes
from daebench.pages.report.two_processes import computed
from daebench.reports import poisson, problems
from daebench.reports.methods import families, measured


def double(x):
    return 2 * x


def broken(x):
    raise RunFailed(f"{x} does not work.")


def own_process(here, x):
    if os.getpid() != here:
        os._exit(1)
    return x


ALL_JOBS = {"methods": measured.jobs(families.names()), "poisson": poisson.jobs(), "problems": problems.jobs()}


@pytest.mark.parametrize("jobs", ALL_JOBS.values(), ids=ALL_JOBS)
def test_every_job_of_a_report_is_another_one_and_can_be_sent_to_another_process(jobs):
    assert len(set(jobs)) == len(jobs) >= 40
    assert pickle.loads(pickle.dumps(jobs)) == jobs


def test_without_a_second_core_all_is_computed_here_and_in_order_and_a_failure_says_why(monkeypatch):
    monkeypatch.setattr(two_processes, "cores", lambda: 1)
    told = []
    jobs = [(double, (1,)), (double, (3,))]
    assert list(computed(jobs, lambda fraction, doing: told.append(fraction), "one")) == [(jobs[0], 2), (jobs[1], 6)]
    assert told == [0.5, 1.0]
    with pytest.raises(RunFailed, match="7 does not work"):
        list(computed([(broken, (7,))], lambda fraction, doing: None, "one"))


def test_what_other_processes_leave_is_computed_here(monkeypatch):
    def dying(jobs):
        yield jobs[1], 6
        raise BrokenProcessPool

    monkeypatch.setattr(two_processes, "cores", lambda: 2)
    monkeypatch.setattr(two_processes, "_from_two", dying)
    told = []
    jobs = [(double, (k,)) for k in (1, 3, 5)]
    found = list(computed(jobs, lambda fraction, doing: told.append(fraction), "one"))
    assert [result for _, result in found] == [6, 2, 10]
    assert told == sorted(told)
    assert told[-1] == 1.0


@pytest.mark.slow
def test_two_processes_give_what_one_gives():
    jobs = [(math.sqrt, (k,)) for k in range(6)]
    assert dict(computed(jobs, lambda fraction, doing: None, "one")) == {job: math.sqrt(*job[1]) for job in jobs}


@pytest.mark.slow
def test_a_failure_in_another_process_is_raised_here():
    with pytest.raises(ValueError, match="math domain"):
        list(computed([(math.sqrt, (-1,)), *[(math.sqrt, (k,)) for k in range(4)]], lambda fraction, doing: None, "one"))


@pytest.mark.slow
def test_a_process_that_is_lost_loses_no_work():
    jobs = [(own_process, (os.getpid(), k)) for k in range(3)]
    told = []
    found = dict(computed(jobs, lambda fraction, doing: told.append(doing), "one"))
    assert [found[job] for job in jobs] == [0, 1, 2]
    assert "a process was lost" in told[0]
