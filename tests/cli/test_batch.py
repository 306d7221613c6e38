"""`nodegraph sweep` and `nodegraph batch`: tasks on a pool of processes, resumed where they stopped."""

from __future__ import annotations

import json
import os
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest

from nodegraph import batch, formats
from nodegraph.batch import Outcome, Task

pytestmark = pytest.mark.slow


def grey(path: Path) -> float:
    return round(float(formats.read(path).color[0, 0, 0]), 2)


@pytest.fixture
def threads(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run tasks on threads of this process: what is tested is not the pool, and processes take a second to start."""
    monkeypatch.setattr(batch, "process_pool", lambda workers: ThreadPoolExecutor(1))


def test_a_sweep_has_a_folder_for_every_combination(cli, workspace, tmp_path, threads) -> None:
    vary = ["--vary", "picture.level=0..1:3", "--vary", "picture.inverted=off,on"]
    ran = cli("sweep", workspace(), *vary, "--out", tmp_path / "out", "--json")
    assert ran.code == 0
    assert len(ran.json["tasks"]) == 6
    assert ran.json["ok"] is True
    names = {f"picture.level={level},picture.inverted={on}" for level in ("0", "0.5", "1") for on in ("off", "on")}
    assert set(os.listdir(tmp_path / "out")) == names
    assert grey(tmp_path / "out" / "picture.level=1,picture.inverted=off" / "view.png") == 1.0
    assert grey(tmp_path / "out" / "picture.level=1,picture.inverted=on" / "view.png") == 0.0


def test_finished_tasks_are_skipped_and_changed_ones_are_not(cli, workspace, tmp_path, threads) -> None:
    command = ["sweep", workspace(), "--vary", "picture.level=0,1", "--out", tmp_path / "out", "--json"]
    states = [[task["state"] for task in cli(*command).json["tasks"]] for _ in range(2)]
    assert states == [["done", "done"], ["skipped", "skipped"]]
    (tmp_path / "out" / "picture.level=1" / "view.png").unlink()
    assert [task["state"] for task in cli(*command).json["tasks"]] == ["skipped", "done"]
    workspace(picture={"type": "trial.picture", "version": 1, "params": {"inverted": True}})
    assert [task["state"] for task in cli(*command).json["tasks"]] == ["done", "done"]
    assert grey(tmp_path / "out" / "picture.level=1" / "view.png") == 0.0


def test_a_failing_task_does_not_stop_the_others(cli, workspace, tmp_path, threads) -> None:
    nodes = {
        "faulty": {"type": "trial.faulty", "version": 1, "inputs": {"image": "picture.image"}},
        "view": {"type": "output.view", "version": 1, "inputs": {"image": "faulty.same"}},
    }
    ran = cli("sweep", workspace(**nodes), "--vary", "faulty.divisor=-1..1:3", "--out", tmp_path / "out")
    assert ran.code == 1
    assert [Path(line).parent.name for line in ran.out.splitlines()] == ["faulty.divisor=-1", "faulty.divisor=1"]
    assert "faulty.divisor=0: faulty: ZeroDivisionError" in ran.err
    assert "2 done, 1 failed" in ran.err


@pytest.mark.parametrize(
    ("vary", "said"),
    [
        ("picture.level=0..2:3", "picture.level"),
        ("picture.lavel=0..1:3", "did you mean 'level'"),
        ("picture.level=0..1", "0.5..2:4"),
        ("picture.level=a..b:3", "numbers"),
        ("picture.level=0..1:0", "number of values"),
        ("picture.level", "node.param=value"),
    ],
)
def test_a_wrong_variation_is_refused_before_anything_runs(cli, workspace, tmp_path, vary, said) -> None:
    ran = cli("sweep", workspace(), "--vary", vary, "--out", tmp_path / "out")
    assert ran.code == 2
    assert said in ran.err
    assert len(ran.err.splitlines()) == 1
    assert not (tmp_path / "out").exists()


def test_a_batch_puts_each_file_where_the_workspace_reads_one(cli, workspace, tmp_path, threads) -> None:
    (tmp_path / "study").mkdir()
    files = []
    for name, level in (("one.txt", 0.25), ("two.txt", 0.75)):
        (tmp_path / "study" / name).write_text(str(level))
        files.append(tmp_path / "study" / name)
    ran = cli("batch", workspace(), "--over", *files, "--out", tmp_path / "out")
    assert ran.code == 0
    assert {name: grey(tmp_path / "out" / name / "view.png") for name in ("one", "two")} == {"one": 0.25, "two": 0.75}
    files[1].write_text("0.625")
    again = cli("batch", workspace(), "--over", *files, "--out", tmp_path / "out", "--json")
    assert [task["state"] for task in again.json["tasks"]] == ["skipped", "done"]


def test_a_batch_asks_which_file_where_there_are_several(cli, workspace, tmp_path) -> None:
    file = workspace(second={"type": "trial.picture", "version": 1})
    (tmp_path / "a.txt").write_text("0.5")
    ran = cli("batch", file, "--over", tmp_path / "a.txt", "--out", tmp_path / "out")
    assert ran.code == 2
    assert "--into picture.table or --into second.table" in ran.err


def test_a_batch_over_a_missing_file_is_refused(cli, workspace, tmp_path) -> None:
    ran = cli("batch", workspace(), "--over", tmp_path / "nowhere.nii")
    assert ran.code == 2
    assert "nowhere.nii" in ran.err


def test_effects_write_into_the_folder_of_their_task(cli, workspace, tmp_path, threads) -> None:
    path = str(tmp_path / "shared" / "mean.txt")
    note = {"type": "trial.note", "version": 1, "params": {"path": path}, "inputs": {"image": "picture.image"}}
    ran = cli("sweep", workspace(note=note), "--vary", "picture.level=0,1", "--out", tmp_path / "out")
    assert ran.code == 0
    texts = {(tmp_path / "out" / f"picture.level={level}" / "mean.txt").read_text() for level in (0, 1)}
    assert texts == {"0.2500", "1.0000"}
    assert not (tmp_path / "shared").exists()


def test_names_of_folders_are_safe_short_and_different() -> None:
    from nodegraph.cli.many import names_of

    names = names_of(["a/b.c=1", "a b", "a?b", "A_b", "x" * 500, ".."])
    assert names == ["a.b.c=1", "a_b", "a_b_2", "A_b_3", "x" * 120, "task"]


def test_a_range_has_both_its_ends_and_short_numbers() -> None:
    from nodegraph.cli.arguments import values

    assert values("0.1..0.7:7") == ("0.1", "0.2", "0.3", "0.4", "0.5", "0.6", "0.7")
    assert values("1..3:3") == ("1", "2", "3")
    assert values("-1e-3..1e3:2") == ("-0.001", "1000")
    assert values("2..5:1") == ("2",)
    assert values("fast, exact") == ("fast", "exact")


class Fragile(Executor):
    """Runs tasks at once; breaks, as a pool does whose worker died, at the task of one name."""

    def __init__(self, deadly: str, log: list[str]) -> None:
        self.deadly = deadly
        self.log = log
        self.broken = False

    def submit(self, function, task, /):  # type: ignore[no-untyped-def, override]
        from concurrent.futures.process import BrokenProcessPool

        future: Future[Outcome] = Future()
        if self.broken or task.name == self.deadly:
            self.broken = True
            future.set_exception(BrokenProcessPool("a worker died"))
        else:
            self.log.append(task.name)
            future.set_result(Outcome(task.name, "done"))
        return future


def test_only_the_task_that_kills_its_worker_is_lost(tmp_path) -> None:
    log: list[str] = []
    tasks = [Task(f"t{i}", "{}", str(tmp_path / f"t{i}")) for i in range(9)]
    outcomes = batch.run_tasks(tasks, lambda: nullcontext(Fragile("t4", log)), at_once=3)
    assert [outcome.name for outcome in outcomes] == [task.name for task in tasks]
    assert {outcome.name: outcome.state for outcome in outcomes if outcome.state != "done"} == {"t4": "failed"}
    assert outcomes[4].error == "its worker process died"
    assert sorted(log) == sorted({task.name for task in tasks} - {"t4"})


@pytest.mark.slow
def test_a_pool_of_processes_survives_a_crash(cli, workspace, tmp_path) -> None:
    nodes = {
        "deadly": {"type": "trial.deadly", "version": 1, "inputs": {"image": "picture.image"}},
        "view": {"type": "output.view", "version": 1, "inputs": {"image": "deadly.same"}},
    }
    file = workspace(**nodes)
    ran = cli("sweep", file, "--vary", "deadly.now=no,yes", "--workers", 2, "--out", tmp_path / "out", "--json")
    assert ran.code == 1
    assert {task["name"]: task["state"] for task in ran.json["tasks"]} == {
        "deadly.now=no": "done",
        "deadly.now=yes": "failed",
    }


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of Dask and its libraries
def test_a_dask_cluster_runs_the_same_tasks(cli, workspace, tmp_path) -> None:
    from distributed import LocalCluster

    with LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:
        command = ["sweep", workspace(), "--vary", "picture.level=0,1", "--cluster", cluster.scheduler_address]
        ran = cli(*command, "--out", tmp_path / "out", "--json")
    assert ran.code == 0
    assert [task["state"] for task in ran.json["tasks"]] == ["done", "done"]
    assert grey(tmp_path / "out" / "picture.level=1" / "view.png") == 1.0
    record = json.loads((tmp_path / "out" / "picture.level=1" / "task.json").read_text())
    assert record["assignments"] == {"picture.level": "1"}


def test_a_cluster_that_does_not_answer_is_one_sentence(cli, workspace, tmp_path, monkeypatch) -> None:
    import distributed

    def refuse(*_: object, **__: object) -> None:
        raise OSError("timed out")

    monkeypatch.setattr(distributed, "Client", refuse)
    ran = cli("sweep", workspace(), "--vary", "picture.level=0,1", "--cluster", "tcp://127.0.0.1:1", "--out", tmp_path)
    assert ran.code == 2
    assert "no Dask scheduler answers there" in ran.err


def test_the_picture_of_a_task_carries_what_was_set(cli, workspace, tmp_path, threads) -> None:
    cli("sweep", workspace(), "--vary", "picture.level=0.25,1", "--out", tmp_path / "out")
    carried = tmp_path / "out" / "picture.level=0.25" / "view.png"
    assert cli("run", carried, "--out", tmp_path / "again.exr").code == 0
    np.testing.assert_allclose(formats.read(tmp_path / "again.exr").color[0, 0, :3], 0.25)
