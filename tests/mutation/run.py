"""Mutation testing: how many small faults in the equations do the tests notice?

Mutants are made and kept by cosmic-ray. It would start the tests anew for each of them, which takes
longer than the tests; here they run in processes forked from one that has imported everything, with
the mutated module in place of the file, which stays untouched. Kernels are not compiled meanwhile.
"""

import argparse
import gc
import os
import random
import shutil
import sys
import time
import traceback
from collections import Counter, defaultdict
from collections.abc import Container, Iterable, Iterator
from functools import partial
from pathlib import Path

import grimp
import mutants
import trial
from cosmic_ray.work_db import WorkDB, use_db
from cosmic_ray.work_item import MutationSpec, TestOutcome, WorkerOutcome, WorkItem, WorkResult
from trial import Fork, Selection

UNCOMPILED = {
    "kernels": Selection(
        ("solver/test_kernels.py",),
        # Python's own floor refuses NaN, the compiled one does not.
        ("solver/test_kernels.py::test_a_position_that_is_no_number_gives_weights_that_are_none",),
    ),
    "transfer": Selection(("solver/test_transfer.py",)),
    "membrane": Selection(("solver/test_membrane.py",)),
    "steric": Selection(
        ("solver/test_steric.py", "solver/test_contacts.py"),
        only="(test_steric and not sheets and not friction and not interlock and not ripples)"
        " or closing_rate_of_one_pair or films_beyond_the_range",
    ),
}
"""Tests of the modules that hold kernels: those of their own and quick ones of what is above."""

COMPILED = {
    "control": Selection(("solver/test_control.py",)),
    "rheometer": Selection(("solver/test_rheometer.py",)),
    "checkpoint": Selection(("simulation/test_checkpoint.py",)),
    "checkpoint_generations": Selection(("simulation/test_checkpoint_generations.py",)),
}
"""Tests of the modules that hold none, with the kernels compiled."""

_ALIVE = TestOutcome.SURVIVED, TestOutcome.INCOMPETENT
"""Outcomes that no test brought about."""


def main() -> int:
    """Make mutants, run the tests on them and print the table."""
    options = _options()
    options.folder.mkdir(parents=True, exist_ok=True)
    session = options.folder / "session.sqlite"
    if options.fresh or not session.exists():
        mutants.make(session)
    with use_db(str(session), WorkDB.Mode.open) as database:
        if not options.report:
            for group in (UNCOMPILED, COMPILED):
                _run_group(database, group, options)
        print(table(database))
        if options.survivors:
            print(*_survivors(database), sep="\n")
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--folder", type=Path, default=Path(".mutation"), help="work and results")
    parser.add_argument("--fresh", action="store_true", help="make the mutants anew")
    parser.add_argument("--again", action="store_true", help="run the tests on survivors again")
    parser.add_argument("--report", action="store_true", help="only print what was found before")
    parser.add_argument("--survivors", action="store_true", help="print their changes too")
    parser.add_argument("--workers", type=int, default=1, help="mutants at a time")
    parser.add_argument("--minutes", type=float, default=float("inf"), help="stop after these")
    parser.add_argument("--seed", type=int, default=0, help="of the order, which is random")
    parser.add_argument("modules", nargs="*", help="of those listed here; all if none is named")
    return parser.parse_args()


def _run_group(database: WorkDB, group: dict[str, Selection], options: argparse.Namespace) -> None:
    """Run pending mutants of some modules in a process of their own, which compiles or not."""
    group = {name: group[name] for name in group if name in (options.modules or group)}
    pending = [item for item in _pending(database, options.again) if _module(item) in group]
    if not pending:
        return
    # Random, so that a run broken off leaves an even sample; sorted first, as the database is not.
    pending.sort(key=lambda item: _label(item.mutations[0]))
    random.Random(options.seed).shuffle(pending)
    pid = os.fork()
    if not pid:
        # Numba looks at it when it is imported, which is from here on only.
        os.environ["NUMBA_DISABLE_JIT"] = "1" if group.keys() <= UNCOMPILED.keys() else "0"
        status = 1
        try:
            _run_all(options.folder / "session.sqlite", group, pending, options)
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            # Back to the caller only in the process that has the database open.
            sys.stdout.flush()
            sys.stderr.flush()
            os._exit(status)
    if os.waitpid(pid, 0)[1]:
        raise SystemExit("The tests could not be run.")


def _run_all(
    session: Path, group: dict[str, Selection], pending: list[WorkItem], options: argparse.Namespace
) -> None:
    trial.load_everything()
    graph = grimp.build_graph("softslip", cache_dir=None)
    scratch = options.folder.resolve() / "scratch"
    limits = {}
    for name in group:
        # Twice: the first time loads the compiled kernels and the tests' own imports.
        passed, said = trial.run_tests(group[name], scratch)
        seconds = time.process_time()
        passed, said = trial.run_tests(group[name], scratch)
        if not passed:
            raise RuntimeError(f"{name}: the tests fail without a mutant ({said})")
        limits[name] = 3 + 2 * (time.process_time() - seconds)
    # For its grammar.
    mutants.source_of(pending[0].mutations[0])
    # Garbage, which each mutant's tests look for twice, is not in what all have in common.
    gc.freeze()
    deadline = time.monotonic() + 60 * options.minutes
    with use_db(str(session), WorkDB.Mode.open) as database:
        for item, said in _trials(pending, group, graph, limits, scratch, options, deadline):
            database.set_result(item.job_id, _result(said))
    shutil.rmtree(scratch, ignore_errors=True)


def _trials(
    pending: Iterable[WorkItem],
    group: dict[str, Selection],
    graph: grimp.ImportGraph,
    limits: dict[str, float],
    scratch: Path,
    options: argparse.Namespace,
    deadline: float,
) -> Iterator[tuple[WorkItem, str]]:
    """Yield what became of each mutant, as they end."""
    waiting, running = list(reversed(pending)), {}
    killers: dict[str | None, set[str]] = defaultdict(set)
    while waiting or running:
        while waiting and len(running) < options.workers and time.monotonic() < deadline:
            item = waiting.pop()
            name = _module(item)
            likely = killers[item.mutations[0].definition_name]
            work = partial(_try, item, group[name], graph, scratch, frozenset(likely))
            running[Fork.of(work, limits[name])] = item, time.monotonic() + 10 * limits[name]
        if not running:
            return
        time.sleep(0.01)
        for fork, (item, until) in list(running.items()):
            said = fork.ended()
            if said is not None:
                del running[fork]
                if said.startswith("killed test"):
                    test = said.removeprefix("killed ").partition(":")[0]
                    killers[item.mutations[0].definition_name].add(test)
                yield item, said
            elif time.monotonic() > until:
                fork.kill()


def _try(
    item: WorkItem,
    selection: Selection,
    graph: grimp.ImportGraph,
    scratch: Path,
    likely: Container[str],
) -> str:
    (mutation,) = item.mutations
    source = mutants.source_of(mutation)
    if source is None:
        return "nothing"
    module = f"softslip.{_module(item)}"
    trial.forget(module, graph)
    try:
        sys.meta_path.insert(0, trial.Substitute(module, mutation.module_path, source))
    except SyntaxError:
        return "nothing"
    passed, said = trial.run_tests(selection, scratch / str(os.getpid()), likely)
    return "survived" if passed else f"killed {said}"


def _result(said: str) -> WorkResult:
    if said == "nothing":
        return WorkResult(worker_outcome=WorkerOutcome.NO_TEST, output=said)
    outcome = TestOutcome.SURVIVED if said == "survived" else TestOutcome.KILLED
    if not said.startswith(("survived", "killed")):
        outcome = TestOutcome.INCOMPETENT
    return WorkResult(worker_outcome=WorkerOutcome.NORMAL, output=said, test_outcome=outcome)


def _pending(database: WorkDB, again: bool) -> list[WorkItem]:
    """Return the mutants that have not been run, and those to be run again."""
    results = database.results
    done = {job for job, result in results if not (again and result.test_outcome in _ALIVE)}
    return [item for item in database.work_items if item.job_id not in done]


def _module(item: WorkItem) -> str:
    return item.mutations[0].module_path.stem


def _label(mutation: MutationSpec) -> tuple[str, int, int, str, int]:
    return (
        mutation.module_path.stem,
        *mutation.start_pos,
        mutation.operator_name,
        mutation.occurrence,
    )


def table(database: WorkDB) -> str:
    """Return, for each module, how many mutants there are, were run, killed and survived."""
    counts: dict[str, Counter[str]] = {name: Counter() for name in UNCOMPILED | COMPILED}
    results = dict(database.results)
    for item in database.work_items:
        result = results.get(item.job_id)
        if result is None:
            counts[_module(item)]["pending"] += 1
        elif result.worker_outcome == WorkerOutcome.NORMAL:
            counts[_module(item)][str(result.test_outcome.value)] += 1
    counts["all"] = sum(counts.values(), Counter())
    lines = [
        "| Module | Mutants | Run | Killed | Survived | Killed of run |",
        "| --- | ---: | ---: | ---: | ---: | ---: |",
    ]
    for name, count in counts.items():
        killed, run = count["killed"], count["killed"] + count["survived"] + count["incompetent"]
        share = f"{100 * killed / run:.1f} %" if run else "–"
        lines.append(
            f"| {name} | {run + count['pending']} | {run} | {killed} | {run - killed} | {share} |"
        )
    return "\n".join(lines)


def _survivors(database: WorkDB) -> Iterator[str]:
    """Yield place, function, kind and both lines of each mutant that was not killed."""
    found = [
        (item.mutations[0], result.output)
        for item, result in database.completed_work_items
        if result.test_outcome in _ALIVE
    ]
    for mutation, output in sorted(found, key=lambda pair: _label(pair[0])):
        before = mutation.module_path.read_text(encoding="utf-8").splitlines()
        after = (mutants.source_of(mutation) or "").splitlines()
        changed = [
            f"{one.strip()}  →  {other.strip()}"
            for one, other in zip(before, after, strict=False)
            if one != other
        ]
        yield (
            f"{mutation.module_path.name}:{mutation.start_pos[0]} {mutation.definition_name} "
            f"{mutation.operator_name.removeprefix('core/')} [{output}] {changed[:1]}"
        )


if __name__ == "__main__":
    sys.exit(main())
