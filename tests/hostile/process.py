"""A command of elastocap in a process with limits: what it says, how it ends, the time and the memory that it takes."""

import dataclasses
import os
import resource
import signal
import subprocess
import threading
import time

TICKS = os.sysconf("SC_CLK_TCK")


@dataclasses.dataclass
class Done:
    """A process that has ended. `status` is `None` if it was killed because its time was up; `late` is the processor time, in seconds,
    that it took after it was told to stop, or after its --max-time."""

    status: int | None
    out: str
    err: str
    seconds: float
    processor: float
    peak: int
    late: float | None

    @property
    def said(self):
        return self.out + "\n" + self.err


def limits(memory, seconds):
    def apply():
        resource.setrlimit(resource.RLIMIT_AS, (memory, memory))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        # The processor time of a process that nothing else ends.
        resource.setrlimit(resource.RLIMIT_CPU, (int(seconds), int(seconds) + 5))
    return apply


def processor_seconds(pid):
    """Processor time that a process has taken so far; `None` where it has ended."""
    try:
        with open(f"/proc/{pid}/stat") as stat:
            fields = stat.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / TICKS
    except (OSError, IndexError):
        return None


def run(line, folder, memory, processor, wall, stop_after=None, terminate=False):
    """Runs a command in a folder. It is killed after so much processor time or wall-clock time. After `stop_after` seconds it is sent
    SIGTERM, or is expected to stop by itself."""
    begin = time.monotonic()
    with open(folder / ".out", "w+b") as out, open(folder / ".err", "w+b") as err:
        child = subprocess.Popen(line, cwd=folder, stdin=subprocess.DEVNULL, stdout=out, stderr=err, preexec_fn=limits(memory, processor),
                                 env={**os.environ, "RUST_BACKTRACE": "0"})
        killed, at_stop, timers = [], [], []

        def kill():
            killed.append(True)
            child.send_signal(signal.SIGKILL)

        def stop():
            at_stop.append(processor_seconds(child.pid))
            if terminate:
                child.send_signal(signal.SIGTERM)

        timers.append(threading.Timer(wall, kill))
        if stop_after is not None:
            timers.append(threading.Timer(stop_after, stop))
        for timer in timers:
            timer.start()
        # Waits without reaping, so that no timer sends a signal to another process.
        os.waitid(os.P_PID, child.pid, os.WEXITED | os.WNOWAIT)
        for timer in timers:
            timer.cancel()
        for timer in timers:
            timer.join()
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
        taken = usage.ru_utime + usage.ru_stime
        texts = []
        for file in (out, err):
            file.seek(0)
            texts.append(file.read(4_000_000).decode("utf-8", "replace"))
    for name in (".out", ".err"):
        (folder / name).unlink()
    late = taken - at_stop[0] if at_stop and at_stop[0] is not None else None
    ended = killed or child.returncode in (-signal.SIGXCPU, -signal.SIGKILL)
    return Done(None if ended else child.returncode, *texts, time.monotonic() - begin, taken, usage.ru_maxrss * 1024, late)
