//! How much memory a run may take.

/// Memory that a run may use, bytes: four fifths of what is available.
pub(super) fn max_memory() -> u64 {
    let available = available_memory();
    available - available / 5
}

/// Memory available without swapping, bytes; 4 GiB where the system does not say.
fn available_memory() -> u64 {
    // A file that is missing or has another format belongs to another kind of system.
    let read = |path: &str| std::fs::read_to_string(path).ok();
    let free = read("/proc/meminfo").and_then(|text| {
        let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
        line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
    });
    let number = |path: &str| read(path).and_then(|text| text.trim().parse::<u64>().ok());
    // A container's own limit, where there is one.
    let quota = number("/sys/fs/cgroup/memory.max")
        .map(|limit| limit.saturating_sub(number("/sys/fs/cgroup/memory.current").unwrap_or(0)));
    let known = [free, quota].into_iter().flatten().min();
    known.unwrap_or(4 << 30).max(64 << 20)
}
