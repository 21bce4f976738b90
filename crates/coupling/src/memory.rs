//! The memory that a run may use: the free memory of the machine, within the limits of the process and of its
//! control groups.
//!
//! The limits are those of Linux: `ulimit -v`, and the memory controllers of control groups, versions 1 and
//! 2. If the system does not report a limit, there is none.

use std::path::{Path, PathBuf};

use elastocap_linalg::memory::bytes_in_words;

/// The memory assumed to be free if the system reports nothing, bytes. It is not tuned.
const UNKNOWN: u64 = 4 << 30;

/// Address space that the allocator reserves for each thread beyond what it uses, bytes.
const ARENA: u64 = 64 << 20;

/// Limits of at least this value count as none: control groups without a limit report about 2^63.
const NO_LIMIT: u64 = 1 << 60;

/// Remaining memory below which a limit counts as reached: one part in this many of the limit, and at least
/// this many bytes. It is not tuned.
const LAST: (u64, u64) = (100, 4 << 20);

/// The memory that a run may use, bytes: four fifths of the free memory.
pub fn max_memory() -> u64 {
    let free = free_memory();
    free - free / 5
}

/// The smallest remainder of the machine and all limits, bytes.
fn free_memory() -> u64 {
    let rooms = [free_on_machine(), address_space().map(AddressSpace::room), group().map(Group::room)];
    rooms.into_iter().flatten().min().unwrap_or(UNKNOWN)
}

/// Whether the process has limits besides the memory of the machine.
pub fn is_limited() -> bool {
    address_space().is_some() || group().is_some()
}

/// The largest number of threads for which a limit on the address space has room; `None` without such a
/// limit.
pub fn max_threads() -> Option<usize> {
    Some(threads_within(address_space()?.limit, ARENA + of_matrix_products()))
}

/// The number of threads, at least one, that reserve at most half of a limit, bytes; each reserves `each`
/// bytes.
fn threads_within(limit: u64, each: u64) -> usize {
    usize::try_from(limit / 2 / each.max(1)).unwrap_or(usize::MAX).max(1)
}

/// Address space that matrix products (crate private-gemm-x86, used by faer) reserve for each thread and
/// hardly touch, bytes: twice the size of the third-level cache, which some virtual machines report as that
/// of the whole host.
fn of_matrix_products() -> u64 {
    let size = read(Path::new("/sys/devices/system/cpu/cpu0/cache/index3/size"));
    2 * size.and_then(|text| cache_size(&text)).unwrap_or(0)
}

/// The size of a cache as Linux writes it, such as `32768K`, bytes.
fn cache_size(text: &str) -> Option<u64> {
    let text = text.trim();
    let digits = text.trim_end_matches(char::is_alphabetic);
    let unit = match &text[digits.len()..] {
        "" => 1,
        "K" => 1 << 10,
        "M" => 1 << 20,
        "G" => 1 << 30,
        _ => return None,
    };
    digits.parse::<u64>().ok()?.checked_mul(unit)
}

/// A description of the limit that the process is so close to that the next allocation may fail, if any.
pub fn limit_reached() -> Option<String> {
    let close = |used: u64, limit: u64| used.saturating_add((limit / LAST.0).max(LAST.1)) > limit;
    if let Some(space) = address_space()
        && close(space.used, space.limit)
    {
        return Some(format!("{} of address space (ulimit -v)", bytes_in_words(space.limit)));
    }
    let group = group()?;
    close(group.used, group.limit).then(|| format!("{} of its control group", bytes_in_words(group.limit)))
}

/// Memory available without swapping, bytes.
fn free_on_machine() -> Option<u64> {
    kibibytes(&read(Path::new("/proc/meminfo"))?, "MemAvailable:")
}

/// The limit on the address space of the process, and the used part, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct AddressSpace {
    limit: u64,
    used: u64,
}

impl AddressSpace {
    /// The address space left for data, bytes: the allocator reserves more addresses than it hands out.
    fn room(self) -> u64 {
        let left = self.limit.saturating_sub(self.used);
        left - (ARENA * (1 + rayon::current_num_threads() as u64)).min(left / 2)
    }
}

fn address_space() -> Option<AddressSpace> {
    let limit = address_limit(&read(Path::new("/proc/self/limits"))?)?;
    Some(AddressSpace { limit, used: kibibytes(&read(Path::new("/proc/self/status"))?, "VmSize:")? })
}

/// The soft limit on the address space, from the text of `/proc/self/limits`.
fn address_limit(text: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix("Max address space"))?;
    line.split_whitespace().next()?.parse().ok()
}

/// The number of KiB behind a name in a file of `/proc`, as bytes.
fn kibibytes(text: &str, name: &str) -> Option<u64> {
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// The limit of a control group, and its used memory without the cache that the system can reclaim, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Group {
    limit: u64,
    used: u64,
}

impl Group {
    fn room(self) -> u64 {
        self.limit.saturating_sub(self.used)
    }
}

/// The control group with the least remaining memory, among that of the process and its ancestors.
fn group() -> Option<Group> {
    let of_process = read(Path::new("/proc/self/cgroup"))?;
    let found = folders(&of_process).into_iter().filter_map(|(version, folder)| version.group_in(&folder));
    found.min_by_key(|group| group.room())
}

/// The two interfaces of control groups.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Version {
    One,
    Two,
}

impl Version {
    /// The limit of the group whose files are in a folder; `None` without one.
    fn group_in(self, folder: &Path) -> Option<Group> {
        let [limit, used, cache] = match self {
            Self::One => ["memory.limit_in_bytes", "memory.usage_in_bytes", "total_inactive_file"],
            Self::Two => ["memory.max", "memory.current", "inactive_file"],
        };
        let number = |name: &str| read(&folder.join(name))?.trim().parse::<u64>().ok();
        // The file holds the word `max` where there is no limit.
        let limit = number(limit).filter(|limit| *limit < NO_LIMIT)?;
        let statistics = read(&folder.join("memory.stat")).unwrap_or_default();
        let cached = statistics.lines().find_map(|line| line.strip_prefix(cache)?.trim().parse::<u64>().ok());
        Some(Group { limit, used: number(used)?.saturating_sub(cached.unwrap_or(0)) })
    }
}

/// The folders that may hold the limits of a process, from the text of its `/proc/self/cgroup`: those of its
/// groups and of their ancestors.
fn folders(of_process: &str) -> Vec<(Version, PathBuf)> {
    let mut out = Vec::new();
    for line in of_process.lines() {
        let mut fields = line.splitn(3, ':');
        let (Some(_), Some(controllers), Some(path)) = (fields.next(), fields.next(), fields.next()) else {
            continue;
        };
        let (version, root) = if controllers.is_empty() {
            (Version::Two, "/sys/fs/cgroup")
        } else if controllers.split(',').any(|name| name == "memory") {
            (Version::One, "/sys/fs/cgroup/memory")
        } else {
            continue;
        };
        let path = Path::new(path.trim_start_matches('/'));
        // In a container the path may be that of the host, while the files of the container are at the root.
        out.extend(path.ancestors().map(|above| (version, Path::new(root).join(above))));
    }
    out
}

/// The text of a file of the system; `None` if it does not exist, as on another kind of system.
fn read(path: &Path) -> Option<String> {
    std::fs::read_to_string(path).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_limit_on_the_address_space_is_read_and_none_is_told_from_it() {
        let text = |soft: &str| {
            format!(
                "Limit Soft Limit Hard Limit Units\nMax address space         {soft}    unlimited   bytes\n"
            )
        };
        assert_eq!(address_limit(&text("512000000")), Some(512_000_000));
        assert_eq!(address_limit(&text("unlimited")), None);
    }

    #[test]
    fn threads_reserve_half_of_a_limit_at_most() {
        let each = |cache: &str| ARENA + 2 * cache_size(cache).unwrap();
        assert_eq!(threads_within(2_048_000_000, each("32768K\n")), 7);
        assert_eq!(threads_within(2_048_000_000, each("480M")), 1);
        assert_eq!(threads_within(1000, each("491520K")), 1);
        assert_eq!(cache_size("1024"), Some(1024));
        assert_eq!([cache_size("many"), cache_size("12Q"), cache_size("")], [None; 3]);
    }

    #[test]
    fn groups_of_both_versions_and_those_above_them_are_looked_at() {
        let found = folders("9:cpu:/a\n4:hugetlb,memory:/a/b\n0::/c\n");
        let folders_of = |version: Version| -> Vec<String> {
            let matching = found.iter().filter(|(v, _)| *v == version);
            matching.map(|(_, folder)| folder.display().to_string()).collect()
        };
        let memory = "/sys/fs/cgroup/memory";
        assert_eq!(
            folders_of(Version::One),
            [format!("{memory}/a/b"), format!("{memory}/a"), format!("{memory}/")]
        );
        assert_eq!(folders_of(Version::Two), ["/sys/fs/cgroup/c", "/sys/fs/cgroup/"]);
    }

    #[test]
    fn what_a_group_uses_is_counted_without_the_cache() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        write("memory.max", "1000000000\n");
        write("memory.current", "700000000\n");
        write("memory.stat", "anon 1\ninactive_file 300000000\n");
        let group = Version::Two.group_in(folder.path());
        assert_eq!(group, Some(Group { limit: 1_000_000_000, used: 400_000_000 }));
        write("memory.max", "max\n");
        assert_eq!(Version::Two.group_in(folder.path()), None);
        write("memory.limit_in_bytes", "9223372036854771712\n");
        assert_eq!(Version::One.group_in(folder.path()), None);
    }

    #[test]
    fn there_is_memory_on_this_machine() {
        assert!(max_memory() > 1 << 20);
    }
}
