"""What is a fault in the answer of a command."""

import json
import re
import resource
import signal

from .damage import SECRET

MESSAGES = 10
# Processor seconds of a `check`, and of a run after it was told to stop.
CHECK_SECONDS, STOP_SECONDS = 10.0, 2.0
# Bytes that a stopped run may write in a further second: a case of 100,000 load steps leaves a result.json of 170 MB.
BYTES_PER_SECOND = 1e8
# Seconds in which a process may still be loading.
BEGINNING = 0.5
# Why a step may fail in a run though `check` did not foretell it: what finite elements find out at large loads, and what is told as an
# interruption or a lack of memory.
NOT_FORETOLD = re.compile(r"not run|stopped|interrupted|memory|does not converge|Newton|equilibrium|tolerance|no force|unstable|turns? (?:over|inside)|"
                          r"beyond|steps? of the load|self-contact|folds|mesh")


def of_answer(done, is_case=True):
    """The faults of any command."""
    faults = []
    if done.status is None:
        return faults
    if done.status < 0 or done.status >= 128 and done.status != 101:
        faults.append(f"abort or signal: status {done.status}: {done.err[-300:]!r}")
    elif done.status not in (0, 1, 2, 3):
        faults.append(f"status {done.status}")
    for sign in ("panicked", "a defect of elastocap", "contradict"):
        if sign in done.said:
            kind = {"panicked": "panic", "contradict": "contradiction"}.get(sign, "defect")
            faults.append(f"{kind}: " + next(line for line in done.said.split("\n") if sign in line)[:300])
    if SECRET in done.said and not is_case:
        faults.append("content: a file's text is in a message")
    messages = len(re.findall(r"(?m)^(?:error|warning)\b", done.err))
    if messages > MESSAGES:
        faults.append(f"messages: {messages}")
    return faults


def of_check(done, is_case=True):
    faults = of_answer(done, is_case)
    if done.status is None or done.processor > CHECK_SECONDS:
        faults.append(f"hang: {done.processor:.1f} s of processor time")
    if done.status == 1:
        faults.append(f"failed: {first(done.err)}")
    return faults


def of_run(done, folder, stopped_at, terminated=False, is_case=True):
    if terminated and done.status == -signal.SIGTERM and done.seconds < BEGINNING:
        # The signal came before the program had begun.
        return []
    faults = of_answer(done, is_case)
    written = sum(path.stat().st_size for path in folder.glob("out*/**/*") if path.is_file())
    allowed = STOP_SECONDS + written / BYTES_PER_SECOND
    if stopped_at is not None and (done.status is None or done.late is not None and done.late > allowed):
        late = f"{done.late:.1f} s" if done.late is not None else "killed"
        faults.append(f"late: {late} of processor time after the end of {stopped_at:g} s")
    left = [path.name for path in folder.glob("out*/**/*")]
    if done.status in (1, 2) and left:
        faults.append("leftovers: " + ", ".join(left[:10]))
    hidden = [path.name for path in folder.rglob(".*")]
    if done.status is not None and hidden:
        faults.append("leftovers: " + ", ".join(hidden[:10]))
    return faults


def forecast(check):
    """The plan that `check --json` printed; `None` where it printed none."""
    try:
        return json.loads(check.out)
    except ValueError:
        return None


def of_both(check, run, result):
    """Where `check` and `run` of one case contradict each other."""
    faults = []
    if run.status is None or check.status is None:
        return faults
    plan = forecast(check)
    if check.status == 2 and run.status not in (2, 3):
        faults.append(f"lie: check says 2, run {run.status}")
    if check.status in (0, 3) and run.status == 2:
        faults.append(f"lie: check says {check.status}, run 2: {first(run.err)}")
    if run.status == 1:
        faults.append(f"run failed: {first(run.err)}")
    if result and plan:
        planned = {step["index"]: step.get("failure") for step in plan["steps"]}
        doubted = {step["index"]: step.get("doubt") for step in plan["steps"]}
        for index, step in enumerate(result.get("steps", [result])):
            status, foretold = str(step.get("status", "")), planned.get(index)
            if foretold and status.startswith("ok"):
                faults.append(f"lie: step {index} is said to fail ({foretold}), and is {status}")
            in_doubt = doubted.get(index) and doubted[index] in status
            if not foretold and status.startswith("failed") and not in_doubt and not NOT_FORETOLD.search(status):
                faults.append(f"lie: step {index} is not said to fail, and is {status[:200]}")
    if plan:
        said = max(plan["memory_bytes"], (plan.get("layer") or {}).get("memory_bytes", 0))
        # What a process inherits in this number from the one that started it is no more than that one's.
        least = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
        if said and run.peak > max(said, least):
            faults.append(f"peak: {run.peak * 1e-6:.0f} MB, and {said * 1e-6:.0f} MB at most were foretold")
    return faults


def first(text):
    return next((line for line in text.split("\n") if line.startswith("error")), text.strip()[:200])[:200]
