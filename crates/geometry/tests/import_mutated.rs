//! Whatever the bytes of a file are, the readers answer, and take no more memory than ten times the file.
//!
//! Valid files with bytes changed, cut, doubled and moved; `MUTATED_FILES` sets how many, 5000 if it is not
//! set.

use std::sync::{Mutex, PoisonError};

use elastocap_geometry::import::{gmsh, obj};
use peak_alloc::PeakAlloc;
use proptest::test_runner::{RngAlgorithm, TestRng};

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Held by each test while it measures: the tests of a file run side by side and share the allocator.
static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());

/// What error texts and small tables may take beside ten times the file, bytes.
const BESIDE: usize = 64 << 10;

const SEEDS: [&[u8]; 6] = [
    include_bytes!("data/cube.obj"),
    include_bytes!("data/boxes-22-ascii.msh"),
    include_bytes!("data/boxes-22-binary.msh"),
    include_bytes!("data/boxes-41-ascii.msh"),
    include_bytes!("data/boxes-41-binary.msh"),
    include_bytes!("data/second-order-41-ascii.msh"),
];
const PIECES: [&[u8]; 10] = [
    b"-",
    b"9999999999",
    b"1e308",
    b"nan",
    b"\n",
    b" ",
    b"0",
    b"f 1 2 3\n",
    b"$EndNodes\n",
    b"\xff\xff\xff\xff",
];

fn mutated(rng: &mut TestRng) -> Vec<u8> {
    use proptest::prelude::Rng;
    let mut below = |n: usize| (rng.next_u64() % n.max(1) as u64) as usize;
    let mut bytes = SEEDS[below(SEEDS.len())].to_vec();
    for _ in 0..1 + below(6) {
        let at = below(bytes.len());
        let to = (at + below(60)).min(bytes.len());
        match below(7) {
            0 if at < bytes.len() => bytes[at] = below(256) as u8,
            1 if at < bytes.len() => bytes[at] ^= 1 << below(8),
            2 => bytes.truncate(at),
            3 => drop(bytes.drain(at..to)),
            4 => drop(bytes.splice(at..to, PIECES[below(PIECES.len())].iter().copied())),
            5 => {
                let piece = bytes[at..to].to_vec();
                let place = below(bytes.len());
                drop(bytes.splice(place..place, piece));
            }
            // A number that is another one, where the format still holds.
            _ => {
                let digit = |b: &u8| b.is_ascii_digit();
                if let Some(k) = bytes[at..].iter().position(digit) {
                    bytes[at + k] = b'0' + below(10) as u8;
                }
            }
        }
    }
    bytes
}

/// The largest memory that a reader takes for a file, and its answer, must stay within the bound.
fn check_peak(what: &str, bytes: &[u8]) {
    let placement = obj::Placement { unit: 1.0, translate: [0.0; 3] };
    MEMORY.reset_peak_usage();
    let before = MEMORY.current_usage();
    let read = obj::read(bytes, "file").is_ok();
    let reading = MEMORY.peak_usage().saturating_sub(before);
    let taken = obj::surface(bytes, "file", placement).is_ok();
    let peak = MEMORY.peak_usage().saturating_sub(before);
    let times = |peak: usize| peak as f64 / bytes.len() as f64;
    println!(
        "{what}: read {read} at {:.1} times, taken {taken} at {:.1} times the file",
        times(reading),
        times(peak)
    );
    assert!(
        reading <= 10 * bytes.len() + (512 << 10),
        "{what}: {reading} bytes for a file of {}",
        bytes.len()
    );
}

#[test]
fn large_files_of_short_lines_are_read_within_ten_times_their_size() {
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    // Just beyond a power of two, where a list that grows by doubling is emptiest.
    let many = (1 << 17) + 1;
    let points = "v 0 0 0\n".repeat(many);
    check_peak("points without faces", points.as_bytes());
    check_peak("points with one face", format!("{points}f 1 2 3\n").as_bytes());
    let three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    check_peak("the same triangle", format!("{three}{}", "f 1 2 3\n".repeat(many)).as_bytes());
    check_peak("the same point as a face", format!("{three}{}", "f 1\n".repeat(many)).as_bytes());
    check_peak("empty faces", format!("{three}{}", "f\n".repeat(many)).as_bytes());
    check_peak("one long face", format!("{three}f{}\n", " 1 2 3".repeat(many / 3)).as_bytes());
    check_peak(
        "long faces",
        format!("{three}{}", format!("f{}\n", " 1 2 3".repeat(1365)).repeat(100)).as_bytes(),
    );
    let scattered = |k: usize| 1 + k * 65_537 % many;
    let faces: String = (0..many)
        .map(|k| format!("f {} {} {}\n", scattered(3 * k), scattered(3 * k + 1), scattered(3 * k + 2)))
        .collect();
    check_peak("triangles of scattered points", format!("{points}{faces}").as_bytes());
}

#[test]
fn mutated_files_are_answered_within_ten_times_their_size() {
    let _alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
    let count: usize = std::env::var("MUTATED_FILES").ok().and_then(|s| s.parse().ok()).unwrap_or(5000);
    let placement = obj::Placement { unit: 1.0, translate: [0.0; 3] };
    let mut rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[7; 32]);
    let (mut taken, mut most) = (0, 0.0_f64);
    for _ in 0..count {
        let bytes = mutated(&mut rng);
        MEMORY.reset_peak_usage();
        let before = MEMORY.current_usage();
        let as_obj = obj::surface(&bytes, "file", placement).is_ok();
        let as_mesh = gmsh::mesh(&bytes, "file", placement).is_ok();
        let peak = MEMORY.peak_usage().saturating_sub(before);
        assert!(peak <= 10 * bytes.len() + BESIDE, "{peak} bytes for a file of {}", bytes.len());
        taken += usize::from(as_obj || as_mesh);
        most = most.max(peak as f64 / (bytes.len().max(4096)) as f64);
    }
    println!("{count} files, {taken} taken, at most {most:.1} times the file");
    assert!(taken > 0 && taken < count);
}
