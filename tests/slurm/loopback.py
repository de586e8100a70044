"""A Slurm cluster on one machine: a controller and two node daemons that talk over loopback.

Slurm and munge are those of Debian (`make slurm` installs them). Whatever they keep lies in one
folder, but for ``/etc/slurm/slurm.conf``, which programs within jobs read.
"""

import os
import shutil
import subprocess
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

CONF = Path("/etc/slurm/slurm.conf")

PROGRAMS = ("slurmctld", "slurmd", "sbatch", "squeue", "scancel", "scontrol", "munged")

NODES = ("node1", "node2")

PATIENCE = 120.0
"""Seconds within which a daemon must answer."""

LOST_AFTER = 20
"""Seconds without an answer after which the controller takes a node for lost."""

CONFIGURATION = """\
ClusterName=loopback
SlurmctldHost=localhost(127.0.0.1)
SlurmctldPort=16817
SlurmUser=root
SlurmdUser=root
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket,cred_expire=30
StateSaveLocation={folder}/controller
SlurmdSpoolDir={folder}/%n
SlurmctldPidFile={folder}/slurmctld.pid
SlurmdPidFile={folder}/%n.pid
SlurmctldLogFile={folder}/slurmctld.log
SlurmdLogFile={folder}/%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
JobAcctGatherType=jobacct_gather/none
AccountingStorageType=accounting_storage/none
MpiDefault=none
SelectType=select/cons_tres
SelectTypeParameters=CR_CPU_Memory
SlurmdParameters=config_overrides
SlurmdTimeout={lost}
ReturnToService=2
MinJobAge=14400
SchedulerParameters=batch_sched_delay=0,sched_min_interval=500000
NodeName={nodes} NodeHostname=localhost NodeAddr=127.0.0.1 Port=[16901-16902] CPUs=1 RealMemory=4000
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""
"""One processor each, so that two jobs run at a time."""


def missing() -> str:
    """Return why there can be no cluster here, empty where there can."""
    absent = [name for name in PROGRAMS if shutil.which(name) is None]
    if absent:
        return f"{absent[0]} is not installed; on Debian: make slurm"
    if os.geteuid() != 0:
        return "node daemons can only be started by root"
    if CONF.exists() and not _is_left_over():
        return f"{CONF} exists: a cluster is already configured here"
    return ""


def _is_left_over() -> bool:
    """Tell whether what is configured is a cluster of ours, which was killed before its end."""
    ours = CONF.read_text().startswith(CONFIGURATION.splitlines()[0])
    return ours and "UP" not in said("scontrol", "ping")


def said(*words: str) -> str:
    """Return what one of Slurm's programs prints; what it complains about, where it fails."""
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=PATIENCE)
    return done.stdout if done.returncode == 0 else f"{done.stdout}{done.stderr}"


def wait_until(what: str, holds: Callable[[], bool], seconds: float = PATIENCE) -> None:
    """Wait until something holds, or fail with what it was."""
    deadline = time.monotonic() + seconds
    while not holds():
        if time.monotonic() > deadline:
            raise TimeoutError(f"not within {seconds:g} s: {what}")
        time.sleep(0.2)


class Cluster:
    """A running cluster; its daemons end with the block.

    Parameters
    ----------
    folder
        Where its files go; made by root for root alone, as munge wants it.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._daemons: dict[str, subprocess.Popen[bytes]] = {}

    def __enter__(self) -> "Cluster":
        self.folder.mkdir(mode=0o755, parents=True)
        for name in ("controller", *NODES):
            (self.folder / name).mkdir()
        key = self.folder / "munge.key"
        key.write_bytes(os.urandom(128))
        key.chmod(0o400)
        nodes = f"{NODES[0]},{NODES[1]}"
        CONF.parent.mkdir(exist_ok=True)
        CONF.write_text(CONFIGURATION.format(folder=self.folder, nodes=nodes, lost=LOST_AFTER))
        try:
            self._start_munge()
            self.start_controller()
            for node in NODES:
                self.start_node(node)
            wait_until("both nodes are idle", lambda: self.states() == {"idle"})
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_: object) -> None:
        subprocess.run(["scancel", "--user=root"], check=False, capture_output=True)
        with suppress(TimeoutError):
            wait_until("no job runs", lambda: not said("squeue", "--noheader"))
        for daemon in reversed(self._daemons.values()):
            daemon.terminate()
        for daemon in self._daemons.values():
            daemon.wait(timeout=PATIENCE)
        CONF.unlink()

    def _start(self, name: str, *words: str) -> None:
        # In a session of its own: what ends the tests does not end it before they are over.
        with (self.folder / f"{name}.said").open("ab") as log:
            self._daemons[name] = subprocess.Popen(
                words, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True
            )

    def _start_munge(self) -> None:
        files = {"key-file": "key", "socket": "socket", "pid-file": "pid", "seed-file": "seed"}
        options = [f"--{option}={self.folder}/munge.{end}" for option, end in files.items()]
        # munge wants folders above that nobody else may write to, which /tmp is not.
        self._start("munge", "munged", "--foreground", "--force", *options)
        wait_until("munge listens", (self.folder / "munge.socket").exists)

    def start_controller(self) -> None:
        """Start the controller; it takes up the jobs that it knew."""
        self._start("controller", "slurmctld", "-D")
        wait_until("the controller answers", lambda: "UP" in said("scontrol", "ping"))

    def end_controller(self) -> None:
        """End the controller; jobs keep running."""
        self._daemons["controller"].terminate()
        self._daemons["controller"].wait(timeout=PATIENCE)

    def start_node(self, node: str = NODES[1]) -> None:
        """Start a node's daemon."""
        self._start(node, "slurmd", "-D", "-N", node)

    def kill_node(self, node: str = NODES[1]) -> None:
        """Kill a node's daemon, not the jobs on the node."""
        self._daemons[node].kill()
        self._daemons[node].wait(timeout=PATIENCE)

    def cancel(self, job: str) -> bool:
        """Cancel a job; return whether the controller has done so."""
        words = ("scancel", "--verbose", job)
        done = subprocess.run(words, capture_output=True, check=False, timeout=PATIENCE)
        return done.returncode == 0

    def states(self) -> set[str]:
        """Return the states of the nodes, such as 'idle' and 'down*'."""
        return set(said("sinfo", "--noheader", "--Node", "--format=%t").split())

    def limits(self) -> list[str]:
        """Return the time limit of each job, such as '5:00'."""
        return said("squeue", "--noheader", "--states=all", "--format=%l").split()

    def ends(self) -> list[str]:
        """Return how each job has ended, such as 'CANCELLED'."""
        return said("squeue", "--noheader", "--states=all", "--format=%T").split()
