"""What commands may inherit and be called in: variables, standard streams, users and folders.

Tables whose product with all commands is what `test_hostile_environments` draws from.
"""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

NONSENSE = ("", "0", "-1", "foo", "1000000")
"""What is no good value of most variables."""

NOWHERE = ("", "/proc/none/folder", "/dev/null", "/dev/null/folder")
"""Folders that cannot be used."""

VARIABLES: Mapping[str, Sequence[str | None]] = {
    # Terminals, and what writes to them.
    "COLUMNS": (*NONSENSE, "1"),
    "LINES": NONSENSE,
    "TERM": ("", "dumb", "foo", "xterm-256color"),
    "COLORTERM": ("truecolor",),
    "NO_COLOR": ("", "1"),
    "CLICOLOR": ("0",),
    "TTY_COMPATIBLE": NONSENSE,
    "TTY_INTERACTIVE": NONSENSE,
    "TERMINAL_WIDTH": NONSENSE,
    "UNICODE_VERSION": ("foo", "1"),
    "GITHUB_ACTIONS": ("true",),
    "TYPER_USE_RICH": NONSENSE,
    "_TYPER_STANDARD_TRACEBACK": ("1",),
    "_SOFTSLIP_COMPLETE": ("", "foo", "bash_source", "complete_zsh"),
    # Notebooks.
    "MPLBACKEND": ("", "foo", "module://matplotlib_inline.backend_inline", "TkAgg", "svg"),
    "MPLCONFIGDIR": NOWHERE,
    "MATPLOTLIBRC": (*NOWHERE, "{here}/nonsense", "{here}/binary", "{here}/matplotlibrc"),
    "JPY_PARENT_PID": ("1",),
    "JUPYTER_COLUMNS": NONSENSE,
    "JUPYTER_LINES": NONSENSE,
    "IPYTHONDIR": NOWHERE,
    "PYTHONSTARTUP": ("{here}/nonsense",),
    # Python.
    "PYTHONOPTIMIZE": ("1", "2"),
    "PYTHONDONTWRITEBYTECODE": ("1",),
    "PYTHONPYCACHEPREFIX": NOWHERE,
    "PYTHONHASHSEED": ("0", "1", "random"),
    "PYTHONIOENCODING": ("ascii", "latin-1", "ascii:strict"),
    "PYTHONUTF8": ("0", "1"),
    "PYTHONCOERCECLOCALE": ("0",),
    "PYTHONWARNINGS": ("error", "foo", "always", "ignore"),
    "PYTHONDEVMODE": ("1",),
    "PYTHONUNBUFFERED": ("1",),
    "PYTHONFAULTHANDLER": ("1",),
    "PYTHONBREAKPOINT": ("foo",),
    "PYTHONNOUSERSITE": ("1",),
    # Languages and times.
    "LC_ALL": ("C", "POSIX", "tr_TR.UTF-8", "de_DE", "foo"),
    "LC_NUMERIC": ("de_DE.UTF-8",),
    "LANG": ("", "C", "foo"),
    "LANGUAGE": ("de",),
    "TZ": ("", "foo", "Asia/Kathmandu", ":/dev/null"),
    "SOURCE_DATE_EPOCH": (*NONSENSE, "1e9"),
    # The compiler.
    "NUMBA_NUM_THREADS": NONSENSE,
    "NUMBA_DEFAULT_NUM_THREADS": NONSENSE,
    "NUMBA_DISABLE_JIT": ("foo", "1"),
    "NUMBA_CACHE_DIR": NOWHERE,
    "NUMBA_THREADING_LAYER": ("", "foo", "tbb"),
    "NUMBA_THREADING_LAYER_PRIORITY": ("", "foo"),
    "NUMBA_CPU_NAME": ("foo", "generic"),
    "NUMBA_CPU_FEATURES": ("", "foo", "-avx2"),
    "NUMBA_OPT": (*NONSENSE, "1"),
    "NUMBA_LOOP_VECTORIZE": ("0",),
    "NUMBA_SLP_VECTORIZE": ("1",),
    "NUMBA_ENABLE_AVX": ("0",),
    "NUMBA_DISABLE_INTEL_SVML": ("1",),
    "NUMBA_BOUNDSCHECK": ("foo",),
    "NUMBA_CAPTURED_ERRORS": ("foo", "old_style", "new_style"),
    "NUMBA_DEBUG_CACHE": ("1",),
    "NUMBA_DUMP_BYTECODE": ("1",),
    "NUMBA_WARNINGS": ("1",),
    "NUMBA_COLOR_SCHEME": ("foo",),
    # Arrays and transforms.
    "NUMPY_MADVISE_HUGEPAGE": NONSENSE,
    "NPY_DISABLE_CPU_FEATURES": ("foo", "AVX2 FMA3"),
    "NPY_ENABLE_CPU_FEATURES": ("foo", "AVX2"),
    "NPY_PROMOTION_STATE": ("legacy", "foo"),
    "PYFFTW_NUM_THREADS": NONSENSE,
    "PYFFTW_PLANNER_EFFORT": ("foo", "FFTW_MEASURE"),
    "SCIPY_ARRAY_API": NONSENSE,
    "PANDAS_COPY_ON_WRITE": NONSENSE,
    "PANDAS_FUTURE_INFER_STRING": NONSENSE,
    "OPENBLAS_NUM_THREADS": NONSENSE,
    "OPENBLAS_VERBOSE": ("2",),
    "OMP_NUM_THREADS": NONSENSE,
    "OMP_PROC_BIND": ("foo", "true"),
    "OMP_SCHEDULE": ("foo",),
    "OMP_DISPLAY_ENV": ("true",),
    "KMP_AFFINITY": ("foo",),
    "MKL_NUM_THREADS": NONSENSE,
    # Files.
    "HDF5_USE_FILE_LOCKING": ("", "foo", "FALSE", "BEST_EFFORT"),
    "HDF5_PLUGIN_PATH": NOWHERE,
    "HDF5_PLUGIN_PRELOAD": ("foo", "::"),
    "HDF5_DRIVER": ("foo", "core", "split", "sec2"),
    "HDF5_DISABLE_VERSION_CHECK": NONSENSE,
    "HDF5_PREFER_PARALLEL_ERROR_API": ("foo",),
    "NETCDF_LOG_LEVEL": ("5",),
    "TMPDIR": NOWHERE,
    "HOME": (None, *NOWHERE),
    "XDG_CACHE_HOME": NOWHERE,
    "XDG_CONFIG_HOME": NOWHERE,
    "XDG_DATA_HOME": NOWHERE,
    "USER": (None, "", "foo"),
    "PATH": (None, "", "/proc/none"),
    "PWD": (None, "", "/proc/none"),
    "PILLOW_BLOCK_SIZE": NONSENSE,
    "PSUTIL_DEBUG": ("1",),
    "PYDANTIC_DISABLE_PLUGINS": NONSENSE,
    "RUAMEL_DEBUG": ("1",),
    "YAMLDEBUG": ("1",),
    # Schedulers and launchers.
    "PMI_FD": ("5", "foo"),
    "PMI_RANK": ("0", "1"),
    "PMI_SIZE": ("2",),
    "PMI_PORT": ("localhost:1",),
    "PMI_ID": ("0",),
    "PMIX_RANK": ("0",),
    "PMIX_NAMESPACE": ("x",),
    "PMIX_SERVER_URI": ("foo",),
    "OMPI_COMM_WORLD_RANK": ("1",),
    "OMPI_COMM_WORLD_SIZE": ("2",),
    "MPICH_DBG": ("foo",),
    "MPIR_CVAR_CH4_NETMOD": ("foo",),
    "MPIR_CVAR_ENABLE_GPU": ("1",),
    "HYDI_CONTROL_FD": ("5",),
    "FI_PROVIDER": ("foo",),
    "UCX_TLS": ("foo",),
    "SLURM_JOB_ID": ("1",),
    "SLURM_PROCID": ("1",),
    "SLURM_NTASKS": ("2",),
    "LAMMPS_POTENTIALS": NOWHERE,
    "LAMMPS_PLUGIN_PATH": NOWHERE,
    # Version control and package managers.
    "GIT_DIR": NOWHERE,
    "GIT_WORK_TREE": NOWHERE,
    "GIT_TRACE": ("1",),
    "GIT_CONFIG_GLOBAL": NOWHERE,
    "GIT_CEILING_DIRECTORIES": ("/",),
    "CONDA_PREFIX": NOWHERE,
    "VIRTUAL_ENV": NOWHERE,
    "PIP_REQUIRE_VIRTUALENV": ("1",),
    "SNAKEMAKE_PROFILE": ("foo",),
    "SNAKEMAKE_OUTPUT_CACHE": NOWHERE,
}
"""Values that variables may be inherited with; None is a variable that is missing."""


ALONE = ("NUMBA_CACHE_DIR",)
"""Variables that are tried by themselves only: all kernels would be compiled again."""


def environments() -> Iterator[dict[str, str | None]]:
    """Yield environments that together hold every value, as many variables as there are in each."""
    together = {name: values for name, values in VARIABLES.items() if name not in ALONE}
    for number in range(max(map(len, together.values()))):
        yield {name: values[number % len(values)] for name, values in together.items()}


FILES = {
    "nonsense": b"\x00 this: is [no file = of any kind\n",
    "binary": bytes(range(256)),
    "matplotlibrc": b"savefig.dpi: 17\nfont.size: 30\ntext.usetex: True\nbackend: foo\n",
}
"""Files beside the project that variables name."""


def _nothing(project: Path) -> None:
    pass


def _removed(*names: str) -> Callable[[Path], None]:
    def change(project: Path) -> None:
        for name in names:
            path = project / name
            shutil.rmtree(path) if path.is_dir() else path.unlink()

    return change


def _file_for(name: str) -> Callable[[Path], None]:
    """Put a file where a folder is, or a folder where a file is."""

    def change(project: Path) -> None:
        path = project / name
        was_folder = path.is_dir()
        if path.exists():
            _removed(name)(project)
        path.write_text("x") if was_folder or not path.suffix else path.mkdir()

    return change


def _written(content: bytes, *patterns: str) -> Callable[[Path], None]:
    def change(project: Path) -> None:
        for pattern in patterns:
            found = list(project.glob(pattern)) or [project / pattern]
            for path in found:
                path.write_bytes(content)

    return change


def _link_to(target: str, name: str) -> Callable[[Path], None]:
    def change(project: Path) -> None:
        if os.path.lexists(project / name):
            _removed(name)(project)
        (project / name).symlink_to(target)

    return change


def _mode(mode: int, *patterns: str) -> Callable[[Path], None]:
    def change(project: Path) -> None:
        for pattern in patterns:
            for path in [project] if pattern == "." else list(project.glob(pattern)):
                path.chmod(mode)

    return change


RESULTS, SCENARIO = "results/small", "config/small.yaml"

FOLDERS: Mapping[str, Callable[[Path], None]] = {
    "as it is": _nothing,
    "no config": _removed("config"),
    "no scenario": _removed(SCENARIO),
    "no results": _removed("results"),
    "no shear": _removed(f"{RESULTS}/shear"),
    "no tables": _removed(f"{RESULTS}/flow_curve.nc", f"{RESULTS}/profiles.nc"),
    "config is a file": _file_for("config"),
    "results is a file": _file_for("results"),
    "results of the scenario are a file": _file_for(RESULTS),
    "a stage is a file": _file_for(f"{RESULTS}/shear"),
    "out is a file": _file_for("out"),
    "a table is a folder": _file_for(f"{RESULTS}/flow_curve.nc"),
    "a figure is a folder": _file_for(f"{RESULTS}/figures/fig4.png"),
    "scenario is empty": _written(b"", SCENARIO),
    "scenario is binary": _written(bytes(range(256)), SCENARIO),
    "scenario is not UTF-8": _written(b"description: \xff\xfe\n", SCENARIO),
    "scenario is a list": _written(b"- 1\n- 2\n", SCENARIO),
    "scenario is a folder": _file_for(SCENARIO),
    "scenario is a pipe": lambda project: (
        (project / SCENARIO).unlink(),
        os.mkfifo(project / SCENARIO),
    )[1],
    "scenario is a link to itself": _link_to("small.yaml", SCENARIO),
    "runs are empty": _written(b"", f"{RESULTS}/*/*.nc"),
    "runs are binary": _written(bytes(range(256)) * 40, f"{RESULTS}/*/*.nc"),
    "runs begin like HDF5": _written(b"\x89HDF\r\n\x1a\n" + b"\0" * 5000, f"{RESULTS}/*/*.nc"),
    "tables are empty": _written(b"", f"{RESULTS}/*.nc"),
    "figures are empty": _written(b"", f"{RESULTS}/figures/*.png"),
    "figures are binary": _written(b"\x89PNG\r\n\x1a\n\0\0", f"{RESULTS}/figures/*.png"),
    "results link to themselves": _link_to("small", RESULTS),
    "results link to nowhere": _link_to("/proc/none", RESULTS),
    "out links to nowhere": _link_to("/proc/none/folder", "out"),
    "out links to itself": _link_to("out", "out"),
    "settings of numba": _written(b"disable_jit: foo\nopt: [1\n", ".numba_config.yaml"),
    "settings of matplotlib": _written(FILES["nonsense"], "matplotlibrc"),
    "settings of git": _written(FILES["nonsense"], ".gitconfig", ".git"),
}
"""What may be wrong in a project's folder."""

READ_AT_START = ("settings of numba", "settings of matplotlib", "settings of git")
"""What is read when Python or a library is started, so that each command needs a new process."""

NAMES: Mapping[str, bytes] = {
    "spaces": b" a  b ",
    "quotes": b"'\"`$(x)",
    "newline": b"a\nb",
    "dash": b"-rf",
    "accents": "é ü 漢 🦆".encode(),
    "not UTF-8": b"a\xff\xfeb",
    "braces": b"{run} %s {0} [red]",
    "long": b"x" * 250,
    "escape": b"\x1b[31m",
    "backslash": b"a\\b",
    "glob": b"*[a-z]?",
    "hash": b"#a?b&c",
}
"""Names of the folder that a project lies in."""

RIGHTS: Mapping[str, Callable[[Path], None]] = {
    "nothing may be written": _mode(0o555, ".", "out", "results/**", "config"),
    "results may not be looked into": _mode(0o000, RESULTS),
    "runs may not be listed": _mode(0o311, f"{RESULTS}/shear"),
    "runs may not be entered": _mode(0o644, f"{RESULTS}/shear"),
    "runs may not be read": _mode(0o000, f"{RESULTS}/*/*.nc"),
    "tables may not be read": _mode(0o000, f"{RESULTS}/*.nc"),
    "scenario may not be read": _mode(0o000, SCENARIO),
    "config may not be entered": _mode(0o600, "config"),
}
"""What may be forbidden to a user."""

WITHOUT_PRIVILEGES = 'exec setpriv --bounding-set=-dac_override,-dac_read_search "$@"'
"""Line of a shell that runs a command as root to whom rights apply, as they do to all others."""

STREAMS: Mapping[str, str] = {
    "output is full": '"$@" > /dev/full',
    "output is closed": '"$@" >&-',
    "nobody reads": '"$@" | true; exit ${PIPESTATUS[0]}',
    "errors are closed": '"$@" 2>&-',
    "errors are full": '"$@" 2> /dev/full',
    "input is closed": '"$@" <&-',
    "all are closed": '"$@" <&- >&- 2>&-',
}
"""Lines of a shell that run a command with standard streams as they may be inherited."""


@dataclass(frozen=True)
class Said:
    """How a command ended, and what it said."""

    status: int
    output: str
    errors: str


def called(
    folder: Path | bytes,
    words: Sequence[str],
    variables: Mapping[str, str | None] | None = None,
    stream: str | None = None,
) -> Said:
    """Run a command of the product in a process of its own."""
    environment = {**os.environ, "PYTHONSAFEPATH": "1"}
    for name, value in (variables or {}).items():
        if value is None:
            environment.pop(name, None)
        else:
            environment[name] = value
    command = [sys.executable, "-m", "softslip", *words]
    if stream is not None:
        command = ["/bin/bash", "-c", stream, "bash", *command]
    done = subprocess.run(
        command,
        cwd=folder,
        env=environment,
        stdin=subprocess.DEVNULL,
        capture_output=True,
        timeout=300,
        check=False,
    )
    texts = (each.decode("utf-8", "replace") for each in (done.stdout, done.stderr))
    return Said(done.returncode, *texts)
