"""Looking for a Stribeck term where there is none must not find one, however many shapes are tried."""

from __future__ import annotations

import numpy as np
import synthetic

from drivetwin.identification import Settings, identify
from drivetwin.identification.cross_validation import searched_gain


def test_gain_of_a_search_among_noise_is_not_positive_on_average() -> None:
    gains = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        base, trials, target = np.ones((60, 1)), rng.standard_normal((60, 96)), rng.standard_normal(60)
        gains.append(searched_gain(base, trials, target))
    assert np.mean(gains) < 0.0
    assert np.mean(np.array(gains) > 0.1) < 0.1


def test_p_value_pays_for_the_search_and_says_so() -> None:
    recordings = [synthetic.record(synthetic.strokes(), synthetic.PLAIN, np.random.default_rng(k)) for k in range(12)]
    tests = [identify(synthetic.turntable(), [one], settings=Settings()).axes["turn"].stribeck for one in recordings]
    assert not any(test.real for test in tests)
    assert all("Bonferroni" in test.name and "anew without each fold" in test.name for test in tests)
    assert min(test.p_value for test in tests) > 0.02
