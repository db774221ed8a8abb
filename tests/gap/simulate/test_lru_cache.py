"""The latest results are kept, those asked for longest ago forgotten."""

from __future__ import annotations

from bayes_hw.gap.simulate.lru_cache import LruCache


def test_what_was_asked_for_longest_ago_is_forgotten() -> None:
    recent: LruCache[str, int] = LruCache(2)
    recent["a"], recent["b"] = 1, 2
    assert recent["a"] == 1
    recent["c"] = 3
    assert (recent["a"], recent["b"], recent["c"]) == (1, None, 3)


def test_a_result_is_replaced() -> None:
    recent: LruCache[str, int] = LruCache(2)
    for value in range(5):
        recent["a"] = value
    recent["b"] = 7
    assert (recent["a"], recent["b"]) == (4, 7)
