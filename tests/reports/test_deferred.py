"""Figures of a page are drawn while the next page of a gallery is computed; nothing is lost and nothing is said too early."""

from concurrent.futures import Future
from types import SimpleNamespace

import pytest

from daebench.errors import Interrupted, RunFailed
from daebench.pages.report import build_stamp, deferred, make_page
from daebench.pages.report.deferred import later, meanwhile, putting_off
from daebench.pages.report.gallery import PagesFailed, build_all
from daebench.pages.report.reports import Report

TEXT = """{% extends "page.html" %}{% block title %}A page{% endblock %}{% block content %}<p>{{ words }}</p>{% endblock %}"""


class Log(list):
    """What happened, in order: tells which pages are there whenever something happens."""

    def report(self, name, *, waits=False, refuted=None, drawn=None, kind="report"):
        """Return a report that logs when it is measured and drawn; it may wait for processes, or fail in either part."""

        def measure(tell):
            self.append(f"{name} begins")
            if waits:
                meanwhile()
            if refuted:
                raise refuted
            self.append(f"{name} measured")
            return name

        def content(numbers, findings):
            self.append(f"{name} drawn")
            if drawn:
                raise drawn
            return {"words": f"This is {numbers}."}

        def make(out, progress):
            return make_page(TEXT, out, "make", progress, measure=measure, check=lambda numbers: SimpleNamespace(), content=content)

        return Report(name, f"About {name}", "make", make, kind=kind)

    def gallery(self, out, *reports):
        return build_all(out, reports, lambda fraction, doing: None, lambda made: self.append(f"{made.name} told"))


def test_outside_of_a_gallery_a_page_is_drawn_at_once(tmp_path):
    log = Log()
    page = build_page(log, tmp_path)
    assert "This is one." in page.read_text(encoding="utf-8")
    assert log == ["one begins", "one measured", "one drawn"]


def build_page(log, out):
    report = log.report("one")
    return report.make(out, lambda fraction, doing: None)


def test_a_page_is_drawn_and_told_of_when_the_next_one_waits_for_processes(tmp_path):
    log = Log()
    made = log.gallery(tmp_path, log.report("one"), log.report("two", waits=True), log.report("three"))
    before = ["one begins", "one measured", "two begins", "one drawn", "one told", "two measured"]
    assert log == [*before, "three begins", "three measured", "two drawn", "two told", "three drawn", "three told"]
    assert [each.name for each in made] == ["one", "two", "three"]
    for each in made:
        assert f"This is {each.name}." in each.page.read_text(encoding="utf-8")
        assert build_stamp.read(tmp_path / each.name) is not None
    assert all(name in (tmp_path / "index.html").read_text(encoding="utf-8") for name in ("one", "two", "three"))


def test_a_page_that_cannot_be_drawn_fails_alone(tmp_path):
    log = Log()
    with pytest.raises(PagesFailed, match="1 of 3 pages failed, the others are written: one: no such figure"):
        log.gallery(tmp_path, log.report("one", drawn=RunFailed("no such figure.")), log.report("two", waits=True), log.report("three"))
    assert build_stamp.read(tmp_path / "one").files == {}
    assert all(build_stamp.read(tmp_path / name).files for name in ("two", "three"))


@pytest.mark.parametrize("stop", [KeyboardInterrupt, Interrupted])
def test_what_was_measured_before_an_interruption_is_drawn(tmp_path, stop):
    log = Log()
    with pytest.raises(stop):
        log.gallery(tmp_path, log.report("one"), log.report("two", refuted=stop("interrupted.")))
    assert build_stamp.read(tmp_path / "one") is not None
    assert "This is one." in (tmp_path / "one" / "index.html").read_text(encoding="utf-8")


def test_a_lesson_is_made_when_a_report_waits_for_processes_after_what_was_put_off(tmp_path):
    log = Log()
    log.gallery(tmp_path, log.report("one"), log.report("two", waits=True), log.report("play", kind="lesson"))
    before = ["one begins", "one measured", "two begins", "one drawn", "one told"]
    assert log == [*before, "play begins", "play measured", "play drawn", "play told", "two measured", "two drawn", "two told"]
    assert build_stamp.read(tmp_path / "play") is not None


def test_nothing_is_put_off_where_nobody_asked_for_it():
    done = []
    later(lambda: done.append(1))
    assert done == [1]
    with putting_off():
        later(lambda: done.append(2))
        later(lambda: done.append(3))
        assert done == [1]
        meanwhile()
        assert done == [1, 2, 3]
        later(lambda: done.append(4))
    assert done == [1, 2, 3, 4]


@pytest.mark.parametrize(("ends", "others", "left"), [(2, 1.0, 1), (3, 0.0, 1), (99, 0.0, 0)])
def test_what_is_done_after_the_awaited_processes_is_time_of_others_and_nothing_that_is_spare(monkeypatch, ends, others, left):
    now, awaited = [0.0], Future()
    monkeypatch.setattr(deferred.time, "perf_counter", lambda: now[0])

    def work():
        now[0] += 1.0
        if now[0] == ends:
            awaited.set_result(None)

    with putting_off() as waiting:
        waiting.works, waiting.spare = [work, work, work], [work]
        meanwhile([awaited])
        assert waiting.seconds == others
        assert waiting.works == []
        assert len(waiting.spare) == left
        assert now[0] == 4.0 - left
