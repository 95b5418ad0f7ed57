"""What sharing a run costs: programs file to file by one run of the command line, by two shares and ``gather``, and by Dask.

``python benches/jobs.py FOLDER [PROGRAMS] [ROUNDS]``, with the command line on PATH or named by TRUEGRIND (release), and the package
installed, on Linux. Processor time is that of a process and of all that it started, servers that outlive it included. Each way writes to a folder of its own below FOLDER, and
nothing is taken away: ext4 does not give out the numbers of files that were deleted within the last minutes, and looking for others takes
longer than the work.
"""

from __future__ import annotations

import ctypes
import math
import os
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path
from statistics import median

ROOT = Path(__file__).resolve().parents[2]
TARGETS = 20

ALONE = """
if __name__ == "__main__":
    from truegrind.dask import compensate_folder
    compensate_folder("in", "arm.toml", "out", csv="all.csv")
"""

WORKERS = """
if __name__ == "__main__":
    from distributed import Client
    from truegrind.dask import compensate_folder
    with Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        compensate_folder("in", "arm.toml", "out", csv="all.csv", client=client)
"""

# What Dask alone costs: workers that are started and ended.
NOTHING = """
if __name__ == "__main__":
    from distributed import Client
    with Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        client.wait_for_workers(2)
"""

# As the documentation of the package has it.
QUIET_WORKERS = """
if __name__ == "__main__":
    import dask
    from distributed import Client
    from truegrind.dask import QUIET, compensate_folder
    with dask.config.set(QUIET), Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        compensate_folder("in", "arm.toml", "out", csv="all.csv", client=client)
"""


# The same, and what was spent from the moment on at which the workers stood.
STEADY = """
import resource

def spent():
    both = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in both)

if __name__ == "__main__":
    import time
    from pathlib import Path
    from distributed import Client
    from truegrind.dask import compensate_folder
    with Client(n_workers=2, threads_per_worker=1, dashboard_address=None) as client:
        # Workers are children of this process and not counted there before they end.
        all_of_it = lambda: spent() + sum(client.run(spent).values())
        before, begin = all_of_it(), time.monotonic()
        compensate_folder("in", "arm.toml", "out", csv="all.csv", client=client)
        Path("spent").write_text(f"{all_of_it() - before} {time.monotonic() - begin}")
"""

PR_SET_CHILD_SUBREAPER = 36


def program(number: int) -> str:
    """Targets in front of the arm, axis 1 in the quarter that the configurations state; as in ``benches/batch.rs``."""
    lines = [f"MODULE Path{number}", "  PROC main()"]
    for k in range(TARGETS):
        x, y = (k % 50) * 2.0, (k // 50) * 4.0
        z = 5.0 * math.sin((x + number) * 0.05)
        lines.append(
            f"    MoveL [[{330 + x:.4f},{y + 4:.4f},{420 + z:.4f}],[0.0000000,0.0000000,1.0000000,0.0000000],[0,0,0,0],"
            "[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]],v100,z1,tool0;"
        )
    return "\n".join([*lines, "  ENDPROC", "ENDMODULE", ""])


def timed(commands: list[list[str]], at: Path) -> tuple[float, float]:
    """Processor time and clock time of commands that run side by side."""
    begin, before = time.monotonic(), resource.getrusage(resource.RUSAGE_CHILDREN)
    said_to = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
    # What outlives its parent becomes ours, and is counted when it ends.
    ctypes.CDLL(None).prctl(PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0)
    running = [subprocess.Popen(command, cwd=at, **said_to) for command in commands]
    for one in running:
        _, said = one.communicate()
        # The command line ends with 1 where it refused something; Python does where a script failed.
        if one.returncode != 0 and (one.returncode != 1 or one.args[0] == sys.executable):
            raise SystemExit(said.decode(errors="replace"))
    clock = time.monotonic() - begin
    while True:
        try:
            os.wait()
        except ChildProcessError:
            break
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime, clock


def main() -> None:
    at = Path(sys.argv[1])
    count = int(sys.argv[2]) if len(sys.argv) > 2 else 10_000
    rounds = int(sys.argv[3]) if len(sys.argv) > 3 else 3
    binary = os.environ.get("TRUEGRIND") or shutil.which("truegrind")
    if binary is None:
        raise SystemExit("the command line is not on PATH: name it by TRUEGRIND")
    (at / "in").mkdir(parents=True)
    for number in range(count):
        (at / "in" / f"path{number:05}.mod").write_text(program(number), encoding="ascii")
    cable = str(ROOT / "tests" / "data" / "irb120-cable.csv")
    timed([[binary, "identify", cable, "--robot", "abb-irb-120", "-o", "arm.toml"]], at)
    base = [binary, "compensate", "in", "--model", "arm.toml", "-o", "out"]
    shares = [[*base, "--shard", f"{share}/2", "--resume", "--brief-records", "--threads", "1"] for share in (1, 2)]
    scripts = {"alone.py": ALONE, "workers.py": WORKERS, "nothing.py": NOTHING, "quiet.py": QUIET_WORKERS, "steady.py": STEADY}
    scripts["large.py"] = QUIET_WORKERS.replace("client=client", "client=client, chunk=1000")
    for name, script in scripts.items():
        (at / name).write_text(script, encoding="utf-8")
    ways = {
        "one run": [[[*base, "--csv", "all.csv"]]],
        "two shares": [shares, [[binary, "gather", "out", "--csv", "all.csv"]]],
        "Dask": [[[sys.executable, "alone.py"]]],
        "workers, nothing to do": [[[sys.executable, "nothing.py"]]],
        "Dask, two processes": [[[sys.executable, "workers.py"]]],
        "the same, quiet": [[[sys.executable, "quiet.py"]]],
        "and chunks of 1,000": [[[sys.executable, "large.py"]]],
        "the work alone": [[[sys.executable, "steady.py"]]],
    }
    found: dict[str, list[tuple[float, float]]] = {name: [] for name in ways}
    written: set[bytes] = set()
    for number in range(rounds):
        for name, steps in ways.items():
            parts = [timed(commands, at) for commands in steps]
            if name == "the work alone":
                cpu, clock = map(float, (at / "spent").read_text().split())
                parts = [(cpu, clock)]
            found[name].append((sum(cpu for cpu, _ in parts), sum(clock for _, clock in parts)))
            if (at / "out").exists():
                written.add((at / "all.csv").read_bytes())
                (at / "all.csv").unlink()
                (at / "out").rename(at / f"{name} {number}")
    assert len(written) == 1, "the ways write different tables"
    plain = median(cpu for cpu, _ in found["one run"])
    print(f"{count} programs of {TARGETS} targets, median of {rounds} (processor s, clock s)")
    for name, times in found.items():
        cpu, clock = median(cpu for cpu, _ in times), median(clock for _, clock in times)
        each = " ".join(f"{cpu:.2f}/{clock:.2f}" for cpu, clock in times)
        print(f"{name:22} {cpu:7.2f} {clock:7.2f}  {100 * (cpu / plain - 1):+5.0f} %   ({each})")


if __name__ == "__main__":
    main()
