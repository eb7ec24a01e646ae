"""The answers of advice beside an exhaustive search: what the documentation says of them is what the kept answers say."""

import json
import re
from pathlib import Path

from exhaustive_search import ACCURACIES, WITHIN, report

ROOT = Path(__file__).parents[2]
ANSWERS = [json.loads(line) for line in (ROOT / "tests" / "support" / "exhaustive_answers.jsonl").read_text().splitlines()]
SAID = re.compile(
    r"on (\d+) problems, for the accuracies 1e-3, 1e-6 and 1e-9, and over (\d+) and (\d+) s.*?"
    r"(\d+) questions.*?It answered (\d+) of them.*?in (\d+) of these",
    re.DOTALL,
)


def known():
    return [one for one in ANSWERS if one["known"] and one["best"] is not None]


def test_the_documentation_says_what_the_kept_answers_say():
    text = (ROOT / "docs" / "how-to" / "choose-a-method.md").read_text(encoding="utf-8")
    answered = [one for one in known() if one["choice"]]
    near = [one for one in answered if one["ratio"] <= WITHIN]
    problems, ends = {one["problem"] for one in known()}, sorted({int(one["t_end"]) for one in known()})
    assert [int(number) for number in SAID.search(text).groups()] == [len(problems), *ends, len(known()), len(answered), len(near)]
    assert {one["accuracy"] for one in ANSWERS} == set(ACCURACIES)


def test_the_documentation_names_the_problems_whose_motion_is_not_known_and_counts_the_others():
    text = (ROOT / "docs" / "how-to" / "choose-a-method.md").read_text(encoding="utf-8")
    unknown = {end: set() for end in (10.0, 100.0)}
    for problem, end in {(one["problem"], one["t_end"]) for one in ANSWERS}:
        if not any(one["known"] for one in ANSWERS if (one["problem"], one["t_end"]) == (problem, end)):
            unknown[end].add(problem)
    names = ", ".join(f"`{name}`" for name in sorted(unknown[10.0]))
    said = re.sub(r", (`\w+`)$", r" and \1", names) + " no motion over 10 s is known that well, and of five others none over 100 s"
    assert said in " ".join(text.split())
    assert len(unknown[100.0] - unknown[10.0]) == 5


def test_most_questions_are_answered_and_most_answers_are_near_the_cheapest():
    answered = [one for one in known() if one["choice"]]
    assert len(answered) >= 0.8 * len(known())
    assert sum(one["ratio"] <= WITHIN for one in answered) >= 0.9 * len(answered)
    assert all(one["choice"]["error"] <= one["accuracy"] for one in answered)


def test_the_report_names_each_answer_that_is_not_near_the_cheapest():
    said = report([one | {"ratio": 1.51} for one in known() if one["choice"]][:3])
    assert "within 1.5 of the cheapest: 0 of 3, 0 % [0, 71]" in said
    assert len(said.splitlines()) == 6
