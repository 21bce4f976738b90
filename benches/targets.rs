//! One line for each target: what was aimed at, what is measured, whether it is met. Some of the lines are
//! in docs/performance.md.
//!
//!     cargo bench --bench targets
//!     ELASTOCAP_LARGE=1 cargo bench --bench targets     (up to ten million unknowns too: some GB, a minute)

mod common;

use std::process::{Command, Stdio};
use std::time::Instant;

use common::Result;
use elastocap_electrostatics::solve;

/// Runs of each are repeated until they took this long together, at least five times and at most forty.
const SECONDS: f64 = 3.0;

/// Median seconds of many runs.
fn median(mut run: impl FnMut() -> Result<()>) -> Result<f64> {
    run()?; // The first one warms caches up.
    let mut times = Vec::new();
    while times.len() < 5 || (times.iter().sum::<f64>() < SECONDS && times.len() < 40) {
        let start = Instant::now();
        run()?;
        times.push(start.elapsed().as_secs_f64());
    }
    times.sort_by(f64::total_cmp);
    Ok(times[times.len() / 2])
}

fn shown(seconds: f64) -> String {
    if seconds < 0.0995 { format!("{:.0} ms", 1e3 * seconds) } else { format!("{seconds:.2} s") }
}

fn line(what: &str, target: &str, measured: &str, met: bool, remark: &str) {
    println!("| {what} | {target} | {measured} | {} | {remark} |", if met { "met" } else { "**missed**" });
}

fn solver() -> Result<()> {
    for (known, accuracy, target) in common::solver_targets()? {
        let what = format!("{}: {}", known.name, accuracy.label());
        let (settings, solution) = match accuracy.reached_on(&known) {
            Ok(found) => found,
            Err(error) => {
                line(&what, &shown(target), "-", false, &error.to_string());
                continue;
            }
        };
        let seconds = median(|| {
            solve(&known.scene, &settings)?;
            Ok(())
        })?;
        let spread = solution.two_terminal.map_or(f64::NAN, |c| (c.upper - c.lower) / c.value);
        let error = known.error_of(&solution);
        let found = if settings.bounds {
            format!("spread {spread:.1e}, error {error:.1e}")
        } else {
            format!("error {error:.1e}, estimate {:.1e}", 0.5 * spread)
        };
        let remark = format!(
            "tolerance {:.0e}: {found}; {} unknowns, {} grids, {} iterations on the last",
            settings.relative_tolerance, solution.unknowns, solution.grids, solution.iterations
        );
        line(&what, &shown(target), &shown(seconds), seconds <= target, &remark);
    }
    Ok(())
}

/// The program itself, as a user starts it.
fn whole_process() -> Result<()> {
    let folder = tempfile::tempdir()?;
    let case = common::case_file("in-plane-pair.toml");
    let arguments = [
        "run".as_ref(),
        case.as_os_str(),
        "--threads".as_ref(),
        "2".as_ref(),
        "--output".as_ref(),
        folder.path().as_os_str(),
    ];
    let binary = env!("CARGO_BIN_EXE_elastocap");
    let seconds = median(|| {
        let status = Command::new(binary).args(arguments).stdout(Stdio::null()).status()?;
        if status.success() { Ok(()) } else { Err(format!("elastocap run: {status}").into()) }
    })?;
    let peak = Command::new("/usr/bin/time").arg("-f").arg("%M").arg(binary).args(arguments).output();
    let peak = peak.ok().and_then(|out| String::from_utf8_lossy(&out.stderr).trim().parse::<f64>().ok());
    let files = std::fs::read_dir(folder.path())?.count();
    let memory =
        peak.map_or_else(|| "not measured (no /usr/bin/time)".to_owned(), |kb| format!("{:.0} MB", kb / 1e3));
    let remark = format!("process start to end, {files} files; peak memory {memory}");
    line(
        "six-step curve of in-plane-pair.toml, every output",
        "0.50 s",
        &shown(seconds),
        seconds <= 0.5,
        &remark,
    );
    Ok(())
}

/// Peak memory of this process since the last [`forget_peak`], bytes; Linux only.
fn peak_memory() -> Option<f64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<f64>().ok().map(|kib| 1024.0 * kib)
}

fn forget_peak() {
    // Where this cannot be done the peak of earlier solves is shown: never too small.
    let _ = std::fs::write("/proc/self/clear_refs", "5");
}

fn scaling() -> Result<()> {
    let known = common::Known::in_plane_pair()?;
    let large = std::env::var_os("ELASTOCAP_LARGE").is_some();
    let mut rows = Vec::new();
    for layers in common::SCALING.into_iter().chain(common::LARGE.into_iter().filter(|_| large)) {
        let settings = common::with_layers(layers);
        forget_peak();
        let solution = solve(&known.scene, &settings)?;
        let memory = peak_memory();
        let mut last = Vec::new();
        let mut once = || {
            let seconds = solve(&known.scene, &settings)?.seconds;
            last.push(seconds.setup + seconds.primal);
            Ok(())
        };
        let whole = if solution.unknowns > 1_500_000 {
            let start = Instant::now();
            once()?;
            start.elapsed().as_secs_f64()
        } else {
            median(once)?
        };
        last.sort_by(f64::total_cmp);
        rows.push((layers, solution, [whole, last[last.len() / 2]], memory));
    }
    println!();
    println!(
        "| layers | unknowns | iterations | this grid | per million unknowns | with the coarser grid for the \
         estimate | peak memory | true error |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for (layers, solution, [whole, last], memory) in &rows {
        println!(
            "| {layers} | {} | {} | {} | {} | {} | {} | {:.0e} |",
            solution.unknowns,
            solution.iterations,
            shown(*last),
            shown(1e6 * last / solution.unknowns as f64),
            shown(*whole),
            memory.map_or_else(|| "-".to_owned(), |bytes| format!("{:.0} MB", bytes * 1e-6)),
            known.error_of(solution),
        );
    }
    Ok(())
}

fn main() -> Result<()> {
    if std::env::args().any(|argument| argument == "--test") {
        return Ok(()); // `cargo test --benches` only asks whether it starts.
    }
    common::two_threads()?;
    println!("| what | target | measured (median) | verdict | how |");
    println!("|---|---|---|---|---|");
    solver()?;
    whole_process()?;
    scaling()
}
