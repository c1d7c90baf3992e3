"""The order of commits. It comes from ancestry: backfilled or imported old versions take their true place."""

from __future__ import annotations

import heapq
import itertools
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence


def lineages(
    commits: Iterable[str], parents: Mapping[str, Sequence[str]], known: Sequence[str] = ()
) -> dict[str, str]:
    """Each commit with a name of its lineage: commits of one are tied by parents or by git, of two by time alone."""
    found: dict[str, str] = {commit: commit for commit in commits}

    def root(commit: str) -> str:
        while found[commit] != commit:
            commit = found[commit] = found[found[commit]]
        return commit

    links = [(parent, commit) for commit in found for parent in parents.get(commit, ())]
    for earlier, later in [*links, *itertools.pairwise(commit for commit in known if commit in found)]:
        if earlier in found:
            found[root(later)] = root(earlier)
    return {commit: root(commit) for commit in found}


def commit_order(
    commits: Iterable[str],
    parents: Mapping[str, Sequence[str]],
    age: Callable[[str], tuple[str, ...]],
    known: Sequence[str] = (),
) -> list[str]:
    """`commits` with ancestors first.

    `parents` holds the hashes of the parents of each commit; parents may be commits that were never run.
    `known` is an order that a trusted source gives for some of them (git itself). Where neither says anything,
    the smaller `age` comes first. A cycle, which only a forged document can hold, is cut at the smallest age.
    """
    wanted = set(commits)
    before: dict[str, set[str]] = {commit: set() for commit in wanted}
    after: dict[str, list[str]] = defaultdict(list)

    def precede(earlier: str, later: str) -> None:
        if earlier != later and earlier not in before[later]:
            before[later].add(earlier)
            after[earlier].append(later)

    for commit in wanted:
        for parent in parents.get(commit, ()):
            if parent in wanted:
                precede(parent, commit)
    chain = [commit for commit in known if commit in wanted]
    for earlier, later in itertools.pairwise(chain):
        precede(earlier, later)

    waiting = {commit: len(earlier) for commit, earlier in before.items()}
    ready = [(age(commit), commit) for commit, count in waiting.items() if count == 0]
    heapq.heapify(ready)
    ordered: list[str] = []
    while waiting:
        if not ready:
            ready = [min((age(commit), commit) for commit in waiting)]
        commit = heapq.heappop(ready)[1]
        if waiting.pop(commit, None) is None:
            continue
        ordered.append(commit)
        for later in after[commit]:
            if later in waiting:
                waiting[later] -= 1
                if waiting[later] == 0:
                    heapq.heappush(ready, (age(later), later))
    return ordered
