"""Runs the models that `elastocap export` writes in the programs that they are meant for, and checks what comes out.

    python3 tests/circuits/check_models.py [--program target/release/elastocap] [--keep FOLDER]

Needs ngspice on the path; fmpy and numpy; for Verilog-A, verilogae (the front end of OpenVAF) and admsXml where they are installed. Solves
two small cases, a pair under force and three conductors under force, and exports both in all formats.

Every number that is checked is printed. The first that is wrong ends the script with status 1.
"""

import argparse
import json
import re
import shutil
import subprocess
import sys
import tempfile
import zipfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]


def check(name, value, limit):
    """Prints a number that must not be larger than its limit, and fails if it is."""
    good = bool(value <= limit)
    print(f"{'ok  ' if good else 'FAIL'}  {name}: {value:.3g} (limit {limit:.3g})", flush=True)
    if not good:
        sys.exit(1)


def hold(name, true):
    """Prints what must be true, and fails if it is not."""
    print(f"{'ok  ' if true else 'FAIL'}  {name}", flush=True)
    if not true:
        sys.exit(1)


class Sensor:
    """A result and its models."""

    def __init__(self, program, case, folder):
        self.name = folder.name
        self.folder = folder.parent
        subprocess.run([program, "run", case, "-o", folder, "--no-fields", "--no-scene", "--quiet"], check=True, stderr=subprocess.DEVNULL)
        for kind, ending in (("spice", "lib"), ("verilog-a", "va"), ("fmu", "fmu"), ("table", "json")):
            arguments = [program, "export", kind, folder, "-o", self.file(ending), "--name", self.name, "--overwrite", "--quiet"]
            subprocess.run(arguments, check=True, stderr=subprocess.DEVNULL)
            once_more = self.file(ending).with_name(f"again.{ending}")
            arguments[5] = once_more
            subprocess.run(arguments, check=True, stderr=subprocess.DEVNULL)
            hold(f"{kind}: the same bytes once more", once_more.read_bytes() == self.file(ending).read_bytes())
        self.result = json.loads((folder / "result.json").read_text())
        self.table = json.loads(self.file("json").read_text())
        self.forces = np.array(self.table["forces_n"])
        self.terminals = re.search(r"Pins: (.*)", self.file("lib").read_text()).group(1).split()[:-2]
        self.capacitors = [(c["from"], c["to"]) for c in self.table["capacitors"]]

    def file(self, ending):
        return self.folder / f"{self.name}.{ending}"

    def at_steps(self, capacitor):
        """Lower bounds, values and upper bounds at the load steps, as the result has them; `None` for capacitors to common, F."""
        steps = sorted(self.result["steps"], key=lambda step: step["force_n"])
        if len(self.capacitors) == 1:
            return np.array([[s["capacitance_lower_f"], s["capacitance_f"], s["capacitance_upper_f"]] for s in steps])
        a, b = self.capacitors[capacitor]
        if b == "common":
            return None
        i, j = (self.result["conductors"].index(name) for name in (a, b))
        return np.array([[-s[f"maxwell_matrix_{which}f"][i][j] for which in ("upper_", "", "lower_")] for s in steps])

    def cubic(self, capacitor, force, which="value_f"):
        """The interpolant from its coefficients, on its own, F."""
        k = int(np.clip(np.searchsorted(self.forces, force, side="right") - 1, 0, len(self.forces) - 2))
        t = np.clip((force - self.forces[k]) / (self.forces[k + 1] - self.forces[k]), 0, 1)
        p = self.table["capacitors"][capacitor][which][k]
        s = 1 - t
        return p[0] * s**3 + 3 * p[1] * t * s**2 + 3 * p[2] * t**2 * s + p[3] * t**3


def ngspice(folder, name, netlist, names):
    """Runs a netlist, and returns the vectors that it writes."""
    out = folder / f"{name}.txt"
    lines = netlist.replace("WRITE", f"set wr_vecnames\nset wr_singlescale\nset numdgt=16\nwrdata {out} {' '.join(names)}")
    (folder / f"{name}.cir").write_text(lines)
    ran = subprocess.run(["ngspice", "-b", f"{name}.cir"], cwd=folder, capture_output=True, text=True, timeout=120)
    if not out.exists():
        print(ran.stdout, ran.stderr)
        sys.exit(f"FAIL  ngspice wrote nothing for {name}")
    return np.loadtxt(out, skiprows=1, ndmin=2).T


def three_forces(sensor):
    """Forces that are no load steps."""
    first, last = sensor.forces[0], sensor.forces[-1]
    return [first + share * (last - first) for share in (0.07, 0.41, 0.88)]


def pair_in_ngspice(pair):
    # Resonance with an inductor in parallel: there the susceptance of both together is zero.
    henry = 1e-3
    for force in three_forces(pair):
        for band, which in ((0, "value_f"), (1, "upper_f"), (-1, "lower_f")):
            right = 1 / (2 * np.pi * np.sqrt(henry * pair.cubic(0, force, which)))
            netlist = f"""* resonance
.include {pair.file('lib')}
X1 p 0 f o {pair.name} band={band}
Lp p 0 {henry}
Rp p 0 1e12
Vf f 0 {force:.17g}
Ip 0 p dc 0 ac 1
.control
ac lin 2001 {right * 0.9998717:.17g} {right * 1.0001:.17g}
let susceptance = imag(1/v(p))
WRITE
.endc
.end
"""
            frequency, b = ngspice(pair.folder, "resonance", netlist, ["susceptance"])
            k = int(np.flatnonzero(np.diff(np.sign(b)) != 0)[0])
            found = frequency[k] - b[k] * (frequency[k + 1] - frequency[k]) / (b[k + 1] - b[k])
            check(f"resonance at {force:.4g} N, band {band}: {found / 1e6:.6f} MHz, relative error", abs(found / right - 1), 1e-6)

    # Charge over a closed cycle of force and voltage, counted by a large capacitor in series.
    last = pair.forces[-1]
    farad = 1e-6
    netlist = f"""* charge over a cycle
.include {pair.file('lib')}
X1 p s f o {pair.name}
Cs s 0 {farad}
Rs s 0 1e18
Vp p 0 PULSE(1 3 0.2 0.3 0.3 0.1 10)
Vf f 0 PWL(0 0 0.1 0 0.4 {last * 0.97:.17g} 0.6 {last * 0.4:.17g} 0.75 {last * 0.8:.17g} 1.0 0 1.2 0)
.options reltol=1e-6 vntol=1e-15 abstol=1e-18 chgtol=1e-22
.control
tran 1m 1.2 0 1m
WRITE
.endc
.end
"""
    time, charge, force = ngspice(pair.folder, "charge", netlist, ["v(s)", "v(f)"])
    largest = np.max(np.abs(charge - charge[0]))
    check(f"charge over a closed cycle: largest {largest * farad:.4g} C, left over relative to it", abs(charge[-1] - charge[0]) / largest, 1e-6)
    volts = np.interp(time, [0, 0.2, 0.5, 0.6, 0.9, 1.2], [1, 1, 3, 3, 1, 1])
    exact = np.array([pair.cubic(0, f) for f in force]) * volts
    wrong = np.max(np.abs((charge - charge[0]) * farad - (exact - exact[0]))) / np.max(np.abs(exact))
    check("charge in between against C(F) V, relative", wrong, 1e-5)

    # The same with C dV/dt in place of d(C V)/dt: this measurement can fail.
    text = pair.file("lib").read_text()
    naive = re.sub(r"Belc_q1 (.*) V=(V\(.*\))\*V\(elc_c1\)", r"Belc_q1 \1 V=\2", text)
    naive = re.sub(r"Felc_q1 (\S+ \S+) Velc_m1 (\S+)", r"Belc_f1 \1 I=i(Velc_m1)*V(elc_c1)*\2", naive)
    (pair.folder / "naive.lib").write_text(naive)
    _, wrong, _ = ngspice(pair.folder, "naive", netlist.replace(f"{pair.name}.lib", "naive.lib"), ["v(s)", "v(f)"])
    left = abs(wrong[-1] - wrong[0]) / np.max(np.abs(wrong - wrong[0]))
    hold(f"with C dV/dt {left:.3g} of it would be left", naive != text and left > 1e-2)

    # With the simulator's own tolerances.
    plain = re.sub(r"(?m)^\.options.*$", "", netlist)
    _, charge, _ = ngspice(pair.folder, "plain", plain, ["v(s)", "v(f)"])
    left = abs(charge[-1] - charge[0]) / np.max(np.abs(charge - charge[0]))
    check("the same cycle with the default tolerances of ngspice", left, 1e-6)

    # Outside the range.
    netlist = f"""* outside
.include {pair.file('lib')}
X1 p 0 f o {pair.name}
Rp p 0 1e12
Vp p 0 1
Vf f 0 0
.control
dc Vf {-0.1 * last:.17g} {1.1 * last:.17g} {last / 40:.17g}
let ratio = v(x1.elc_c1)
WRITE
.endc
.end
"""
    force, flag, c = ngspice(pair.folder, "outside", netlist, ["v(o)", "ratio"])
    beyond = (force < -1e-5 * last) | (force > (1 + 1e-5) * last)
    hold("the flag is 1 V outside the range and 0 V inside", np.all(np.abs(flag - beyond) < 1e-3) and beyond.any())
    scale = pair.cubic(0, pair.forces[0])
    ends = np.where(force < 0, pair.cubic(0, 0.0), pair.cubic(0, last)) / scale
    check("outside the range the capacitance is that at its end", np.max(np.abs(c - ends)[beyond]), 1e-6)


def matrix_in_ngspice(sensor):
    """Each entry of the Maxwell matrix from the currents at one angular frequency, with one terminal at 1 V."""
    omega = 2 * np.pi * 1e6
    # The last pin but one of the file is common; its own entry follows from the others.
    terminals = sensor.terminals[:-1]
    names = list(dict.fromkeys(end for ends in sensor.capacitors for end in ends if end != "common"))
    for force in three_forces(sensor):
        right = np.zeros((len(terminals), len(terminals)))
        for k, (a, b) in enumerate(sensor.capacitors):
            c = sensor.cubic(k, force)
            i = names.index(a)
            right[i, i] += c
            if b != "common":
                j = names.index(b)
                right[j, j] += c
                right[i, j] -= c
                right[j, i] -= c
        found = np.zeros_like(right)
        for j in range(len(terminals)):
            sources = "\n".join(f"V{i} n{i} 0 dc 0 ac {int(i == j)}" for i in range(len(terminals)))
            netlist = f"""* matrix
.include {sensor.file('lib')}
X1 {' '.join(f'n{i}' for i in range(len(terminals)))} 0 f o {sensor.name}
{sources}
Vf f 0 {force:.17g}
.control
ac lin 1 1e6 1e6
{chr(10).join(f'let q{i} = -imag(i(V{i}))' for i in range(len(terminals)))}
WRITE
.endc
.end
"""
            found[:, j] = ngspice(sensor.folder, "matrix", netlist, [f"q{i}" for i in range(len(terminals))])[1:, 0] / omega
        check(f"Maxwell matrix at {force:.4g} N, relative to its largest entry", np.max(np.abs(found - right)) / np.max(right), 1e-6)
        check(f"  its asymmetry", np.max(np.abs(found - found.T)) / np.max(right), 1e-9)
        lowest = np.linalg.eigvalsh(0.5 * (found + found.T))[0]
        hold(f"  its smallest eigenvalue {lowest:.4g} F is positive", lowest > 0)

    # The currents of all terminals and common add up to zero while force and voltages move.
    volts = "\n".join(f"V{i} n{i} 0 SIN({i} 1 {1 + i} 0 0)" for i in range(len(terminals)))
    last = sensor.forces[-1]
    netlist = f"""* sum of currents
.include {sensor.file('lib')}
X1 {' '.join(f'n{i}' for i in range(len(terminals)))} c f o {sensor.name}
{volts}
Vc c 0 0
Vf f 0 SIN({last / 2:.17g} {last / 2.1:.17g} 3 0 0)
.options reltol=1e-6 abstol=1e-18
.control
tran 2m 1
let sum = {' + '.join(f'i(V{i})' for i in range(len(terminals)))} + i(Vc)
let own = i(V0)
WRITE
.endc
.end
"""
    _, total, own = ngspice(sensor.folder, "sum", netlist, ["sum", "own"])
    check("sum of all terminals' currents, relative to one of them", np.max(np.abs(total)) / np.max(np.abs(own)), 1e-9)


def profile(sensor, count=401):
    """Up and down over the whole range."""
    time = np.linspace(0.0, 1.0, count)
    return time, np.interp(time, [0, 0.5, 1], [sensor.forces[0], sensor.forces[-1], sensor.forces[0]])


def fmu(sensor):
    from fmpy import extract, read_model_description, simulate_fmu
    from fmpy.validation import validate_fmu

    path = str(sensor.file("fmu"))
    problems = validate_fmu(path)
    hold(f"validate_fmu finds no problem in {Path(path).name} {problems}", not problems)
    with zipfile.ZipFile(path) as archive:
        hold("the archive is whole, and has a binary", archive.testzip() is None and any("binaries/" in n for n in archive.namelist()))
    description = read_model_description(path)
    inputs = [v.name for v in description.modelVariables if v.causality == "input"]
    names = [v.name for v in description.modelVariables if v.causality == "output" and v.name != "outside"]
    values = [n for n in names if n.startswith("capacitance") and not n.endswith(("_lower", "_upper", "_derivative"))]
    time, force = profile(sensor)
    table = np.zeros(len(time), dtype=[("time", "f8")] + [(n, "f8") for n in inputs])
    table["time"], table["force"] = time, force
    for k, name in enumerate(inputs[1:]):
        table[name] = 1.0 + k
    for kind in ("CoSimulation", "ModelExchange"):
        out = simulate_fmu(path, fmi_type=kind, input=table, output=names + ["force"], stop_time=1.0, output_interval=time[1])
        wrong = turns = 0.0
        outside = -np.inf
        for k, name in enumerate(values):
            # Co-simulation in FMPy sets inputs at the beginning of a step: the force that an output belongs to is beside it.
            right = np.array([sensor.cubic(k, f) for f in out["force"]])
            wrong = max(wrong, np.max(np.abs(out[name] - right)) / right.max())
            known = sensor.at_steps(k)
            if known is not None:
                # Between two steps, the limits of both.
                at = np.clip(np.searchsorted(sensor.forces, out["force"], side="right") - 1, 0, len(sensor.forces) - 2)
                least = np.minimum(known[at, 0], known[at + 1, 0])
                most = np.maximum(known[at, 2], known[at + 1, 2])
                outside = max(outside, float(np.max(np.maximum(least - out[name], out[name] - most))))
            hold(f"{kind}: lower bound, {name} and upper bound are in order",
                 np.all(out[f"{name}_lower"] <= out[name]) and np.all(out[name] <= out[f"{name}_upper"]))
            order = np.argsort(out["force"])
            goes = np.diff(out[name][order])
            turns = max(turns, min(goes.max(initial=0.0), -goes.min(initial=0.0)) / right.max())
        check(f"{kind}: capacitances against the table, relative", wrong, 1e-12)
        check(f"{kind}: how far any is outside the bounds at the steps around it, F", outside, 0.0)
        check(f"{kind}: how far any goes back while the force goes on, relative", turns, 1e-14)
    for k in range(len(values)):
        known = sensor.at_steps(k)
        if known is not None:
            found = np.array([[sensor.cubic(k, f, which) for which in ("lower_f", "value_f", "upper_f")] for f in sensor.forces])
            check(f"{values[k]}: the table against the result at the steps, relative", np.max(np.abs(found / known - 1)), 1e-15)
    at_steps(sensor, path, values)
    saved_states(sensor, path, description, extract)


def at_steps(sensor, path, values):
    """With the force of each load step, the numbers of the result; the band gives its bounds."""
    from fmpy import simulate_fmu

    if len(values) > 1:
        return
    for step in sensor.result["steps"]:
        for band, key in ((-1, "capacitance_lower_f"), (0, "capacitance_f"), (1, "capacitance_upper_f")):
            start = {"force": step["force_n"], "band": band, "voltage": 2.0}
            out = simulate_fmu(path, start_values=start, stop_time=0.1, output=["capacitance", "charge"])
            if abs(out["capacitance"][-1] / step[key] - 1) > 1e-15 or abs(out["charge"][-1] / step[key] / 2 - 1) > 1e-15:
                check(f"step {step['index']}, band {band}", abs(out["capacitance"][-1] / step[key] - 1), 1e-15)
    hold("the FMU has value and bounds of every load step, and charge = C V", True)


def saved_states(sensor, path, description, extract):
    """A state that is saved and restored, in memory and as bytes, goes on in the same way; forces outside are refused."""
    from fmpy.fmi3 import FMU3Slave

    folder = extract(path)
    one = FMU3Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=description.coSimulation.modelIdentifier)
    two = FMU3Slave(guid=description.guid, unzipDirectory=folder, modelIdentifier=description.coSimulation.modelIdentifier)
    reference = {v.name: v.valueReference for v in description.modelVariables}
    charges = [r for n, r in reference.items() if n.startswith("charge")]
    voltages = [r for n, r in reference.items() if n.startswith("voltage")]
    time, force = profile(sensor, 41)
    for instance in (one, two):
        instance.instantiate()
        instance.enterInitializationMode()
        instance.exitInitializationMode()

    def go_on(instance, begin, end):
        out = []
        for k in range(begin, end):
            instance.setFloat64([reference["force"]], [force[k]])
            instance.setFloat64(voltages, [np.sin(k + n) for n in range(len(voltages))])
            instance.doStep(currentCommunicationPoint=time[k], communicationStepSize=time[1])
            out += instance.getFloat64(charges)
        return out

    one.setFloat64([reference["band"]], [0.3])
    go_on(one, 0, 20)
    state = one.getFMUState()
    held = one.serializeFMUState(state)
    first = go_on(one, 20, 40)
    one.setFloat64([reference["band"]], [-1.0])
    one.setFMUState(state)
    again = go_on(one, 20, 40)
    other = two.deserializeFMUState(held)
    two.setFMUState(other)
    elsewhere = go_on(two, 20, 40)
    hold("a restored state goes on to the bit, and one from bytes in another instance too", first == again == elsewhere)

    inner = 0.5 * (force[3] + force[4])
    one.setFloat64([reference["force"]], [inner])
    knowns = [reference["force"]] + voltages
    worst = 0.0
    for n, known in enumerate(knowns):
        found = one.getDirectionalDerivative(charges, [known], [1.0])
        at = one.getFloat64([known])[0]
        away = 1e-5 * (sensor.forces[-1] if n == 0 else 1.0)
        pair = []
        for sign in (1, -1):
            one.setFloat64([known], [at + sign * away])
            pair.append(np.array(one.getFloat64(charges)))
        one.setFloat64([known], [at])
        difference = (pair[0] - pair[1]) / (2 * away)
        worst = max(worst, np.max(np.abs(difference - found)) / max(np.max(np.abs(found)), 1e-30))
    check("directional derivatives against differences, relative", worst, 1e-5)

    def refuses(act):
        try:
            act()
        except Exception:
            return True
        return False

    one.setFloat64([reference["force"]], [1.01 * sensor.forces[-1]])
    hold("a force outside the range is refused by the step and by the outputs",
         refuses(lambda: one.getFloat64(charges)) and refuses(lambda: go_on_outside(one, time)))
    one.setBoolean([reference["refuse_outside"]], [False])
    clamped = one.getFloat64(charges)
    hold("or clamped with a flag, where that is asked for", bool(one.getBoolean([reference["outside"]])[0]))
    one.setFloat64([reference["force"]], [sensor.forces[-1]])
    hold("  to the range's end", clamped == one.getFloat64(charges))
    hold("a band beyond 1 is refused", refuses(lambda: one.setFloat64([reference["band"]], [1.5])))
    hold("bytes of something else are refused", refuses(lambda: two.deserializeFMUState(bytes(len(held)))))
    for instance in (one, two):
        instance.terminate()
        instance.freeInstance()
    shutil.rmtree(folder)


def go_on_outside(instance, time):
    instance.doStep(currentCommunicationPoint=time[-1], communicationStepSize=time[1])


def verilog_a(sensor):
    if shutil.which("admsXml"):
        ran = subprocess.run(["admsXml", "-I/usr/include/adms", "-x", sensor.file("va").name], cwd=sensor.folder, capture_output=True, text=True)
        hold("ADMS parses the Verilog-A module", ran.returncode == 0 and "fatal" not in ran.stdout + ran.stderr)
    else:
        print("not checked: admsXml is not installed")
    try:
        import verilogae
    except ImportError:
        print("not checked: verilogae, the front end of OpenVAF, is not installed")
        return
    # The attribute makes a variable of the module a function that can be called.
    text = sensor.file("va").read_text()
    marked = sensor.folder / f"{sensor.name}_marked.va"
    marked.write_text(re.sub(r"( +)real (elc_c1)", r"\1(*retrieve*) real \2", text))
    module = verilogae.load(str(marked))
    function = module.functions["elc_c1"]
    worst = 0.0
    for force in np.linspace(-0.1, 1.1, 61) * sensor.forces[-1]:
        for band, which in ((0.0, "value_f"), (-1.0, "lower_f"), (1.0, "upper_f")):
            found = function.eval(temperature=300.0, voltages={"br_force_n": float(force)}, band=band)
            worst = max(worst, abs(found / sensor.cubic(0, force, which) - 1))
    check("OpenVAF compiles the module; its first capacitance against the table, relative", worst, 1e-12)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", default=ROOT / "target/release/elastocap", type=Path)
    parser.add_argument("--keep", type=Path, help="folder for all files; a temporary one if not given")
    arguments = parser.parse_args()
    program = arguments.program.resolve()
    with tempfile.TemporaryDirectory() as temporary:
        folder = (arguments.keep or Path(temporary)).resolve()
        folder.mkdir(parents=True, exist_ok=True)
        print("== a pair under force")
        pair = Sensor(program, ROOT / "cases/in-plane-pair-by-force.toml", folder / "pair")
        pair_in_ngspice(pair)
        fmu(pair)
        verilog_a(pair)
        print("== three conductors under force")
        three = Sensor(program, HERE / "three-terminals.toml", folder / "three")
        matrix_in_ngspice(three)
        fmu(three)
        verilog_a(three)
    print("all models are right")


if __name__ == "__main__":
    main()
